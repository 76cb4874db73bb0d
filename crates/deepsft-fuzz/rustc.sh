#!/bin/sh
# Calls rustc for a crate of ours, with coverage for libFuzzer, debug assertions and checks of arithmetic. What runs within rustc or
# cargo is compiled as ever.
case " $* " in
*" --crate-name ___ "* | *" --crate-name build_script_"* | *" --crate-type proc-macro "*) exec "$@" ;;
*" --crate-name "*) ;;
*) exec "$@" ;;
esac
exec "$@" --cfg fuzzing -C passes=sancov-module -C llvm-args=-sanitizer-coverage-level=4 \
    -C llvm-args=-sanitizer-coverage-inline-8bit-counters -C llvm-args=-sanitizer-coverage-pc-table \
    -C llvm-args=-sanitizer-coverage-trace-compares -C debug-assertions=on -C overflow-checks=on
