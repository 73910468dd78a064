# SPDX-License-Identifier: MIT
"""What was really compiled and linked: the codec's flags, and that the libraries others link bring no CGAL along.

Looks at compile_commands.json, at build.ninja's link lines, and with nm and ldd at what came out. The build folder is
told by PMCD_BUILD_DIR, the libraries and the probe program by PMCD_LIBRARIES and PMCD_LINK_PROBE; ctest sets them.
"""

import json
import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

import tree

_MUST = ("-fno-exceptions", "-fno-rtti", "-ffp-contract=off")
_MUST_NOT = ("-ffast-math", "-Ofast", "-funsafe-math-optimizations", "-march=native", "-fexceptions", "-frtti")
_GPL = re.compile(r"cgal|gmp|mpfr", re.IGNORECASE)
# What input and output, threads, clocks and exceptions look like in a symbol table.
_NOT_PURE = re.compile(r"^(?:_ZSt4c(?:out|err|log|in)|_ZNSt8ios_base|_ZNS[oi]|_ZNSt6thread)"
                       r"|^(?:pthread_create|f?printf|f?puts|f?write|fopen|f?read|open|socket|send|recv|time|clock_gettime"
                       r"|__cxa_throw|__cxa_begin_catch|__gxx_personality_v0)(?:@.*)?$")
# libm functions round differently from one library to the next; sqrt is exact everywhere.
_LIBM = re.compile(r"^(sin|cos|tan|asin|acos|atan|atan2|exp|exp2|expm1|log|log2|log10|log1p|pow|cbrt|hypot|fma|ldexp"
                   r"|tgamma|erf)f?(@.*)?$")


def is_core(path):
    return tree.inside(path, "codec") and not tree.inside(path, "codec/import")


def flag_complaints(commands, root):
    """Complaints about the flags of the codec's core in a parsed compile_commands.json."""
    found = []
    for command in commands:
        path = pathlib.Path(command["file"])
        if not path.is_relative_to(root) or not is_core(path.relative_to(root)):
            continue
        flags = command.get("arguments") or shlex.split(command["command"])
        name = path.relative_to(root)
        found += [f"{name}: compiled without {flag}" for flag in _MUST if flag not in flags]
        found += [f"{name}: compiled with {flag}" for flag in _MUST_NOT if flag in flags]
    return found


def undefined_symbols(library):
    listing = subprocess.run(["nm", "--undefined-only", library], check=True, capture_output=True, text=True).stdout
    return {line.split()[-1] for line in listing.splitlines() if " U " in line}


def link_line(ninja, target):
    """The statement in build.ninja that links the program called `target`, with its indented variables."""
    statement = re.search(rf"^build [^\n]*\b{re.escape(target)}: CXX_EXECUTABLE_LINKER[^\n]*\n(?:  [^\n]*\n)*", ninja,
                          re.MULTILINE)
    return statement[0] if statement else None


class FlagCheck(unittest.TestCase):
    """The check itself: it has to complain about what it exists for."""

    def command(self, path, *flags):
        return [{"file": f"/src/{path}", "command": " ".join(["c++", *flags, "-c", f"/src/{path}"])}]

    def complain(self, path, *flags):
        return flag_complaints(self.command(path, *flags), pathlib.Path("/src"))

    def test_missing_flag(self):
        self.assertEqual(self.complain("codec/a.cpp", *_MUST), [])
        self.assertEqual(self.complain("codec/a.cpp", "-fno-rtti", "-ffp-contract=off"),
                         ["codec/a.cpp: compiled without -fno-exceptions"])

    def test_forbidden_flag(self):
        self.assertEqual(self.complain("codec/mesh/a.cpp", *_MUST, "-ffast-math"),
                         ["codec/mesh/a.cpp: compiled with -ffast-math"])

    def test_other_rooms_are_free(self):
        self.assertEqual(self.complain("codec/import/a.cpp"), [])
        self.assertEqual(self.complain("daemon/a.cpp"), [])


class SymbolCheck(unittest.TestCase):
    def test_bad_symbols(self):
        for symbol in ("__cxa_throw", "fopen", "_ZSt4cout", "pthread_create", "printf", "_ZNSolsEi"):
            self.assertRegex(symbol, _NOT_PURE)
        for symbol in ("memcpy", "_Znwm", "_ZSt20__throw_length_errorPKc", "sqrt", "_ZdlPv"):
            self.assertNotRegex(symbol, _NOT_PURE)
            self.assertNotRegex(symbol, _LIBM)
        for symbol in ("sin", "cosf", "pow", "cbrt"):
            self.assertRegex(symbol, _LIBM)

    def test_nm_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder, "a.c")
            source.write_text("int puts(const char*); int f(void) { return puts(\"x\"); }\n", encoding="utf-8")
            subprocess.run(["c++", "-x", "c", "-c", source, "-o", source.with_suffix(".o")], check=True)
            self.assertEqual([symbol for symbol in undefined_symbols(source.with_suffix(".o"))
                              if _NOT_PURE.match(symbol)], ["puts"])


class LinkLineCheck(unittest.TestCase):
    def test_statement_is_found_with_its_variables(self):
        ninja = ("build a: CXX_EXECUTABLE_LINKER__a_Release a.o\n  LINK_LIBRARIES = -lgmp\n\n"
                 "build sub/b: CXX_EXECUTABLE_LINKER__b_Release b.o\n  LINK_LIBRARIES = -lz\n")
        self.assertRegex(link_line(ninja, "a"), _GPL)
        self.assertNotRegex(link_line(ninja, "sub/b"), _GPL)
        self.assertIsNone(link_line(ninja, "c"))


@unittest.skipUnless("PMCD_BUILD_DIR" in os.environ, "PMCD_BUILD_DIR is not set: ctest sets it")
class Build(unittest.TestCase):
    def setUp(self):
        self.build = pathlib.Path(os.environ["PMCD_BUILD_DIR"])
        self.sanitized = bool(os.environ.get("PMCD_SANITIZE"))

    def test_the_codec_is_built_with_its_flags(self):
        commands = json.loads((self.build / "compile_commands.json").read_text(encoding="utf-8"))
        compiled = {pathlib.Path(command["file"]) for command in commands}
        core = [path for path in tree.cpp_files(tree.ROOT) if path.suffix == ".cpp" and is_core(path)]
        self.assertGreater(len(core), 5)
        self.assertEqual([str(path) for path in core if tree.ROOT / path not in compiled], [], "never compiled")
        self.assertEqual(flag_complaints(commands, tree.ROOT), [])

    def test_libraries_use_nothing_of_cgal(self):
        for library in os.environ["PMCD_LIBRARIES"].split(":"):
            self.assertEqual([symbol for symbol in undefined_symbols(library) if _GPL.search(symbol)], [], library)

    def test_the_codec_has_no_io_threads_exceptions_or_libm(self):
        if self.sanitized:
            self.skipTest("sanitizers add calls of their own")
        codec = next(path for path in os.environ["PMCD_LIBRARIES"].split(":") if path.endswith("libpmcd_codec.a"))
        symbols = undefined_symbols(codec)
        self.assertEqual([symbol for symbol in symbols if _NOT_PURE.match(symbol)], [])
        self.assertEqual([symbol for symbol in symbols if _LIBM.match(symbol)], [])

    def test_a_program_that_links_them_does_not_link_cgal(self):
        probe = pathlib.Path(os.environ["PMCD_LINK_PROBE"])
        statement = link_line((self.build / "build.ninja").read_text(encoding="utf-8"),
                              str(probe.relative_to(self.build)))
        self.assertIsNotNone(statement, "the probe is not in build.ninja")
        for library in os.environ["PMCD_LIBRARIES"].split(":"):
            self.assertIn(pathlib.Path(library).name, statement)
        self.assertNotRegex(statement, _GPL)
        needed = subprocess.run(["ldd", probe], check=True, capture_output=True, text=True).stdout
        self.assertNotRegex(needed, _GPL)
        subprocess.run([probe], check=True)


if __name__ == "__main__":
    unittest.main()
