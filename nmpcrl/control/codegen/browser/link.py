"""A wasm32 object file to a module: what a linker would do, for one object that is nearly a module.

The object imports a memory and a stack pointer; the module has both. Places in its code that name
a symbol are written anew (relocated); constants find their place behind the stack, which comes
first so that a call too deep is an error and overwrites nothing.

Source: the WebAssembly specification, section 5, and tool-conventions, "Linking".
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

PAGE = 65_536  # bytes of a page of memory
STACK = 65_536  # bytes
FUNCTIONS = frozenset(  # what a module may import, from "env": JavaScript's Math has them
    ("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cos", "cosh", "exp", "expm1")
    + ("log", "log1p", "pow", "sin", "sinh", "tan", "tanh")
)

MAGIC = b"\0asm\1\0\0\0"
CUSTOM, TYPE, IMPORT, FUNCTION, MEMORY, GLOBAL, EXPORT, CODE, DATA, DATA_COUNT = (
    0, 1, 2, 3, 5, 6, 7, 10, 11, 12,
)  # fmt: skip
FUNCTION_SYMBOL, DATA_SYMBOL, GLOBAL_SYMBOL = 0, 1, 2
SEGMENTS, SYMBOLS = 5, 8  # subsections of "linking"
UNDEFINED, NAMED = 0x10, 0x40  # of a symbol's flags
FUNCTION_INDEX, ADDRESS, SIGNED_ADDRESS, PLAIN_ADDRESS, TYPE_INDEX, GLOBAL_INDEX = 0, 3, 4, 5, 6, 7
I32, MUTABLE, I32_CONST, END = 0x7F, 1, 0x41, 0x0B


class CannotLink(RuntimeError):
    """The object holds what no module of ours may hold; the message says what."""


class Reader:
    """Reads bytes from the front."""

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data, self.at = data, at

    def __bool__(self) -> bool:
        return self.at < len(self.data)

    def byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def take(self, count: int) -> bytes:
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self) -> int:
        """An unsigned LEB128."""
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def signed(self) -> int:
        """A signed LEB128."""
        began = self.at
        value = self.number()
        bits = 7 * (self.at - began)
        return value - (1 << bits) if value >> (bits - 1) else value

    def name(self) -> str:
        return self.take(self.number()).decode()


def number(value: int, width: int = 0) -> bytes:
    """Unsigned LEB128, of `width` bytes if that is given."""
    out = bytearray()
    while value > 0x7F or len(out) + 1 < width:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def vector(items: Iterable[bytes]) -> bytes:
    items = list(items)
    return number(len(items)) + b"".join(items)


def name(text: str) -> bytes:
    return number(len(text)) + text.encode()


@dataclass(frozen=True)
class Symbol:
    """A function, or a piece of data."""

    kind: int
    name: str
    index: int  # of the function, or of the data's segment
    offset: int = 0  # in the segment


def link(data: bytes, exports: Iterable[str], pages: int) -> bytes:
    """The module that exports these functions and its memory, of so many pages.

    Raises:
        CannotLink: it would need more of its host than `FUNCTIONS`, or more memory than it has.
    """
    sections = _sections(data)
    symbols = list(_symbols(sections["linking"]))
    segments, begins = _segments(sections[DATA])
    places, end = _placed(segments, _alignments(sections["linking"]))
    if end >= pages * PAGE:
        raise CannotLink(f"stack and constants take {end} bytes, and {pages} pages are fewer")
    for symbol in symbols:
        if symbol.kind == DATA_SYMBOL and symbol.name in ("bottom", "ceiling"):
            value = end if symbol.name == "bottom" else pages * PAGE
            segments[symbol.index][symbol.offset : symbol.offset + 4] = value.to_bytes(4, "little")
    code = bytearray(sections[CODE])
    for kind, at, index, addend in _relocations(sections.get("reloc.CODE")):
        _relocate(code, kind, at, _value(kind, index, symbols, places) + addend)
    for kind, at, index, addend in _relocations(sections.get("reloc.DATA")):
        k = max(k for k, begin in enumerate(begins) if begin <= at)
        value = _value(kind, index, symbols, places) + addend
        _relocate(segments[k], kind, at - begins[k], value)
    functions = {one.name: one.index for one in symbols if one.kind == FUNCTION_SYMBOL}
    exported = (name(each) + b"\0" + number(functions[each]) for each in exports)
    body = {
        TYPE: sections[TYPE],
        IMPORT: vector(_imports(sections[IMPORT])),
        FUNCTION: sections[FUNCTION],
        MEMORY: vector([b"\1" + number(pages) + number(pages)]),
        GLOBAL: vector([bytes([I32, MUTABLE]) + _constant(STACK)]),
        EXPORT: vector([name("memory") + b"\2\0", *exported]),
        DATA_COUNT: number(len(segments)),
        CODE: bytes(code),
        DATA: vector(
            b"\0" + _constant(place) + number(len(segment)) + segment
            for place, segment in zip(places, segments, strict=True)
        ),
    }
    return MAGIC + b"".join(bytes([k]) + number(len(part)) + part for k, part in body.items())


def _sections(data: bytes) -> dict[int | str, bytes]:
    """The sections by number, the custom ones by name."""
    if not data.startswith(MAGIC):
        raise CannotLink("this is no object file of WebAssembly")
    found: dict[int | str, bytes] = {}
    reader = Reader(data, len(MAGIC))
    while reader:
        kind, body = reader.byte(), Reader(reader.take(reader.number()))
        called = body.name() if kind == CUSTOM else kind
        found[called] = body.data[body.at :]
    return found


def _subsection(linking: bytes, wanted: int) -> Reader:
    reader = Reader(linking)
    reader.number()  # version
    while reader:
        kind, body = reader.byte(), reader.take(reader.number())
        if kind == wanted:
            return Reader(body)
    raise CannotLink(f"the object has no subsection {wanted} of linking")


def _symbols(linking: bytes) -> Iterator[Symbol]:
    reader = _subsection(linking, SYMBOLS)
    for _ in range(reader.number()):
        kind, flags = reader.byte(), reader.number()
        if kind == DATA_SYMBOL:
            called = reader.name()
            if flags & UNDEFINED:
                raise CannotLink(f"{called} is nowhere")
            index, offset, _ = reader.number(), reader.number(), reader.number()
            yield Symbol(kind, called, index, offset)
        elif kind in (FUNCTION_SYMBOL, GLOBAL_SYMBOL):
            index = reader.number()
            named = not flags & UNDEFINED or flags & NAMED
            yield Symbol(kind, reader.name() if named else "", index)
        else:
            raise CannotLink(f"a symbol is of a kind, {kind}, that is not known here")


def _imports(section: bytes) -> Iterator[bytes]:
    """The imported functions alone, as they stand; the memory and the stack pointer are ours."""
    reader, globals_ = Reader(section), 0
    for _ in range(reader.number()):
        module, called, kind = reader.name(), reader.name(), reader.byte()
        if kind == 0:
            if called not in FUNCTIONS:
                raise CannotLink(f"the functions call {called}, which a browser does not have")
            yield name(module) + name(called) + b"\0" + number(reader.number())
        elif kind == 2:
            limited = reader.byte()
            reader.number()
            if limited & 1:
                reader.number()
        elif kind == 3:
            reader.take(2)
            globals_ += 1
            if called != "__stack_pointer" or globals_ > 1:
                raise CannotLink(f"the functions need {called}, which is not known here")
        else:
            raise CannotLink(f"the functions need {called}, of a kind that is not known here")


def _segments(section: bytes) -> tuple[list[bytearray], list[int]]:
    """The pieces of data, and where in the section each begins."""
    reader, segments, begins = Reader(section), [], []
    for _ in range(reader.number()):
        reader.take(2)  # flags, i32.const
        reader.signed()
        reader.byte()  # end
        size = reader.number()
        begins.append(reader.at)
        segments.append(bytearray(reader.take(size)))
    return segments, begins


def _alignments(linking: bytes) -> list[int]:
    """Of each segment, in bytes."""
    reader, found = _subsection(linking, SEGMENTS), []
    for _ in range(reader.number()):
        reader.name()
        found.append(1 << reader.number())
        reader.number()  # flags
    return found


def _placed(segments: list[bytearray], alignments: list[int]) -> tuple[list[int], int]:
    """The address of each segment behind the stack, and the first free one, a multiple of 16."""
    places, end = [], STACK
    for segment, alignment in zip(segments, alignments, strict=True):
        end += -end % alignment
        places.append(end)
        end += len(segment)
    return places, end + -end % 16


def _relocations(section: bytes | None) -> Iterator[tuple[int, int, int, int]]:
    """Kind, offset, symbol and what is added, of each."""
    if section is None:
        return
    reader = Reader(section)
    reader.number()  # which section
    for _ in range(reader.number()):
        kind, at, index = reader.byte(), reader.number(), reader.number()
        addressed = kind in (ADDRESS, SIGNED_ADDRESS, PLAIN_ADDRESS)
        yield kind, at, index, reader.signed() if addressed else 0


def _value(kind: int, index: int, symbols: list[Symbol], places: list[int]) -> int:
    """What a relocation puts in."""
    if kind == TYPE_INDEX:
        return index
    symbol = symbols[index]
    if kind in (FUNCTION_INDEX, GLOBAL_INDEX):
        return symbol.index
    if kind in (ADDRESS, SIGNED_ADDRESS, PLAIN_ADDRESS):
        return places[symbol.index] + symbol.offset
    raise CannotLink(f"a relocation is of a kind, {kind}, that is not known here")


def _relocate(code: bytearray, kind: int, at: int, value: int) -> None:
    """Write a value where a place for it was left: four bytes, or LEB128 of five."""
    if kind == PLAIN_ADDRESS:
        code[at : at + 4] = value.to_bytes(4, "little")
    else:
        code[at : at + 5] = number(value, 5)  # no address has the highest bit of a signed one


def _constant(value: int) -> bytes:
    """An expression: a number of 32 bits, not negative."""
    plain = number(value)
    signed = plain if not plain[-1] & 0x40 else number(value, len(plain) + 1)
    return bytes([I32_CONST]) + signed + bytes([END])
