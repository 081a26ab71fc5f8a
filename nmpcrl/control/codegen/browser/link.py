"""A wasm32 object file to a module: what a linker would do, for one object that is nearly a module.

LLVM has written the right indices into its code, and the right addresses for data that begin at 0.
So the module differs by what the object imports, a memory and a stack pointer, and by its exports.
The stack of `runtime.ll` comes first, so that a call too deep is an error and overwrites nothing.

Source: the WebAssembly specification, section 5, and tool-conventions, "Linking".
"""

from collections.abc import Iterable, Iterator
from io import BytesIO

PAGES = 64  # of 64 KiB; a solve with 40 planned inputs among 16 obstacles takes three of them
STACK, BOTTOM = 65_536, 131_072  # addresses of `runtime.ll`: constants are between them
FUNCTIONS = frozenset(  # what a module may import, from "env": JavaScript's Math has them
    ("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cos", "cosh", "exp", "expm1")
    + ("log", "log1p", "pow", "sin", "sinh", "tan", "tanh")
)

MAGIC = b"\0asm\1\0\0\0"
CUSTOM, TYPE, IMPORT, FUNCTION, MEMORY, GLOBAL, EXPORT, CODE, DATA = 0, 1, 2, 3, 5, 6, 7, 10, 11
SYMBOLS = 8  # a subsection of "linking"
FUNCTION_SYMBOL, DATA_SYMBOL, GLOBAL_SYMBOL = 0, 1, 2
UNDEFINED, NAMED = 0x10, 0x40  # of a symbol's flags


class CannotLink(Exception):
    """The object holds what no module of ours may hold; the message says what."""


def link(data: bytes, exports: Iterable[str]) -> bytes:
    """The module that exports these functions and its memory.

    Raises:
        CannotLink: it would need more of its host than `FUNCTIONS`.
    """
    sections = _sections(BytesIO(data))
    indices = dict(_functions(BytesIO(sections[CUSTOM])))
    exported = (_name(each) + b"\0" + _bytes(indices[each]) for each in exports)
    body = {
        TYPE: sections[TYPE],
        IMPORT: _vector(_imports(BytesIO(sections[IMPORT]))),
        FUNCTION: sections[FUNCTION],
        MEMORY: _vector([b"\1" + _bytes(PAGES) + _bytes(PAGES)]),
        GLOBAL: _vector([b"\x7f\1\x41" + _bytes(STACK) + b"\x0b"]),  # the stack's end, a variable
        EXPORT: _vector([_name("memory") + b"\2\0", *exported]),
        CODE: sections[CODE],
        DATA: _vector(_constants(BytesIO(sections[DATA]))),
    }
    return MAGIC + b"".join(bytes([k]) + _bytes(len(part)) + part for k, part in body.items())


def _sections(data: BytesIO) -> dict[int, bytes]:
    """The content of each section; of custom sections, only "linking"."""
    contents = {}
    data.seek(len(MAGIC))
    while kind := data.read(1):
        content = data.read(_number(data))
        if kind[0] != CUSTOM or content.startswith(_name("linking")):
            contents[kind[0]] = content
    return contents


def _functions(linking: BytesIO) -> Iterator[tuple[str, int]]:
    """Name and index of each function."""
    linking.seek(len(_name("linking")))
    _number(linking)  # version
    while linking.read(1)[0] != SYMBOLS:
        linking.read(_number(linking))
    _number(linking)  # size
    for _ in range(_number(linking)):
        kind, flags = linking.read(1)[0], _number(linking)
        if kind == DATA_SYMBOL:
            name = _text(linking)
            if flags & UNDEFINED:
                raise CannotLink(f"the data {name} are not defined")
            for _ in range(3):  # segment, offset, size
                _number(linking)
        elif kind in (FUNCTION_SYMBOL, GLOBAL_SYMBOL):
            index = _number(linking)
            name = _text(linking) if not flags & UNDEFINED or flags & NAMED else ""
            if kind == FUNCTION_SYMBOL:
                yield name, index
        else:
            raise CannotLink(f"a symbol is of a kind, {kind}, that is not known here")


def _imports(section: BytesIO) -> Iterator[bytes]:
    """The imported functions; memory and stack pointer are the module's own."""
    for _ in range(_number(section)):
        module, name, kind = _text(section), _text(section), section.read(1)[0]
        if name == "__linear_memory":
            section.read(1)  # without a maximum
            _number(section)
        elif name == "__stack_pointer":
            section.read(2)  # its type
        elif kind == 0 and name in FUNCTIONS:
            yield _name(module) + _name(name) + b"\0" + _bytes(_number(section))
        else:
            raise CannotLink(f"the functions call {name}, which a browser does not have")


def _constants(section: BytesIO) -> Iterator[bytes]:
    """The pieces of data that are not zero, as they are; the first piece is the stack."""
    for number in range(_number(section)):
        began = section.tell()
        section.read(2)  # the address is a constant
        address, _, content = _number(section), section.read(1), section.read(_number(section))
        first, last = (STACK, BOTTOM) if number else (0, STACK)
        if not first <= address <= last - len(content):
            raise CannotLink(f"{len(content)} bytes of data are at {address}")
        if any(content):
            yield section.getvalue()[began : section.tell()]


def _number(stream: BytesIO) -> int:
    """The next LEB128, not negative."""
    value = shift = 0
    while True:
        byte = stream.read(1)[0]
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value


def _text(stream: BytesIO) -> str:
    return stream.read(_number(stream)).decode()


def _bytes(value: int) -> bytes:
    """LEB128, unsigned."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _vector(items: Iterable[bytes]) -> bytes:
    items = list(items)
    return _bytes(len(items)) + b"".join(items)


def _name(text: str) -> bytes:
    return _bytes(len(text)) + text.encode()
