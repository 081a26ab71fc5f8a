"""Reads texts as JSON on standard input, and writes the module on standard output."""

import json
import sys

from nmpcrl.control.codegen.browser.emit import RUNTIME, emit
from nmpcrl.control.codegen.browser.ir import describe
from nmpcrl.control.codegen.browser.link import link

functions, ir = describe(json.load(sys.stdin))
exports = [*RUNTIME, *(function.name for function in functions)]
sys.stdout.buffer.write(link(emit(functions, ir), exports))
