# SPDX-License-Identifier: MIT
# in: RUN (command line, a list), EXPECTED (file). Fails unless RUN exits 0 and prints the file.
execute_process(COMMAND ${RUN} OUTPUT_VARIABLE output RESULT_VARIABLE status TIMEOUT 120)
string(REPLACE "\r" "" output "${output}")
message("${output}")
if(NOT status EQUAL 0)
    message(FATAL_ERROR "the runner ended with ${status}: a number is outside its bound, or it crashed")
endif()
file(READ ${EXPECTED} expected)
if(NOT output STREQUAL expected)
    message(FATAL_ERROR "this target computes other bits than ${EXPECTED}:\n${expected}"
        "If arithmetic, behaviour or vectors were changed on purpose, and all targets agree:\n"
        "  build/host/bin/conformance > tests/conformance/expected.txt")
endif()
