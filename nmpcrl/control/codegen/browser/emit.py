"""LLVM IR of a package's functions to an object file for wasm32, with `runtime.ll` linked to it."""

import re
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import llvmlite.binding as llvm

from nmpcrl.control.codegen.browser.ir import Function

TRIPLE = "wasm32-unknown-unknown"
FEATURES = "+sign-ext,+nontrapping-fptoint,+bulk-memory"  # in every browser since 2021
RUNTIME = ("reserve", "release", "why")  # of runtime.ll, exported
STACK = "stack"  # which nothing names
OVERFLOWING = "@llvm.smul.with.overflow.i64"
FOR_A_MACHINE = re.compile(r"^target (?:datalayout|triple) = .*\n", flags=re.M)

# Hides the pointers to result and error that numba's functions begin with.
WRAPPER = """
declare i32 @"{symbol}"(ptr, ptr, {types})
define {result} @{name}({arguments}) {{
  %result = alloca {result}
  %error = alloca ptr
  store ptr null, ptr %error
  %bottom = load i32, ptr @bottom
  store i32 %bottom, ptr @heap
  store i32 0, ptr @last
  %status = call i32 @"{symbol}"(ptr %result, ptr %error, {arguments})
  %failed = icmp ne i32 %status, 0
  br i1 %failed, label %fails, label %returns
fails:
  call void @end_call(i32 3)
  unreachable
returns:
  %value = load {result}, ptr %result
  ret {result} %value
}}
"""


def emit(functions: Sequence[Function], ir: str) -> bytes:
    """One object file of functions and of all that they call."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(TRIPLE)
    machine = target.create_target_machine(opt=3, reloc="static", features=FEATURES)
    ir = FOR_A_MACHINE.sub("", ir).replace(OVERFLOWING, "@product_of_sizes")
    ir = ir.replace("alwaysinline", "inlinehint")  # a fifth smaller and 8 % slower: pages load it
    module = llvm.parse_assembly(ir)
    runtime = files(__package__).joinpath("runtime.ll").read_text("utf-8")
    wrappers = [_wrapper(function, module) for function in functions]
    whole = llvm.parse_assembly("\n".join([runtime, *wrappers]))
    whole.link_in(module)
    whole.triple = TRIPLE
    whole.data_layout = str(machine.target_data)
    exported = {STACK, *RUNTIME, *(function.name for function in functions)}
    for one in (*whole.functions, *whole.global_variables):
        if not one.is_declaration:  # all but what is exported may be inlined, or dropped
            one.linkage = "external" if one.name in exported else "internal"
    whole.verify()
    _optimise(whole, machine)
    return bytes(machine.emit_object(whole))


def _wrapper(function: Function, module: Any) -> str:
    _, _, *types = (str(one.type) for one in module.get_function(function.symbol).arguments)
    return WRAPPER.format(
        **function._asdict(),
        types=", ".join(types),
        arguments=", ".join(f"{kind} %a{k}" for k, kind in enumerate(types)),
    )


def _optimise(module: Any, machine: Any) -> None:
    """As numba does for a machine, without vectors: they were slower.

    Functions are made small before they are inlined: it saves a thirtieth of the module.
    """
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    small, pruned = (llvm.create_new_module_pass_manager() for _ in range(2))
    small.add_sroa_pass()
    small.add_instruction_combine_pass()
    small.add_simplify_cfg_pass()
    small.run(module, builder)
    pruned.add_refprune_pass()
    pruned.run(module, builder)
    for _ in range(2):
        builder.getModulePassManager().run(module, builder)
        pruned.run(module, builder)
