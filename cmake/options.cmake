# __FILE__, as in a failed assertion, counts from the root of the sources; ccache gives the compiler relative paths.
file(RELATIVE_PATH to_root ${CMAKE_BINARY_DIR} ${CMAKE_SOURCE_DIR})
string(REGEX REPLACE "([^/])$" "\\1/" to_root "${to_root}")

# Flags that every target shares. The core's arithmetic must be the same on every
# machine, hence no contraction and no fast-math anywhere (DESIGN §4).
add_library(cb_flags INTERFACE)
target_compile_options(cb_flags INTERFACE -Wall -Wextra -Werror -Wshadow -Wconversion -ffp-contract=off
    -fmacro-prefix-map=${CMAKE_SOURCE_DIR}/= -fmacro-prefix-map=${to_root}=
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wswitch-enum -Wvla>)
target_include_directories(cb_flags INTERFACE ${CMAKE_SOURCE_DIR})

# What only the portable core must obey: no double precision, no heap of its own.
add_library(cb_core_flags INTERFACE)
target_link_libraries(cb_core_flags INTERFACE cb_flags)
target_compile_options(cb_core_flags INTERFACE -Wdouble-promotion $<$<C_COMPILER_ID:GNU>:-Wunsuffixed-float-constants> -fno-builtin-malloc)

# Linux programs read what a hostile network or file holds. A write beyond a local array or a known object
# ends the program, its tables are read-only once it is loaded, and its place in memory is random
# (tests/gates/hardening.py). _FORTIFY_SOURCE needs optimisation, and the sanitizers look closer than it does.
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
    target_compile_options(cb_flags INTERFACE -fstack-protector-strong -fPIE)
    target_link_options(cb_flags INTERFACE -pie -Wl,-z,relro,-z,now,-z,noexecstack -Wl,--as-needed)
    if(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
        target_compile_options(cb_flags INTERFACE -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
    endif()
endif()
