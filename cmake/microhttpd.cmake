# libmicrohttpd: compbox-view serves by it.
find_path(MICROHTTPD_INCLUDE microhttpd.h)
find_library(MICROHTTPD_LIBRARY microhttpd)
if(NOT MICROHTTPD_INCLUDE OR NOT MICROHTTPD_LIBRARY)
    message(FATAL_ERROR "libmicrohttpd is not there: scripts/setup installs it, for arm64 scripts/arm64-sysroot")
endif()
add_library(libmicrohttpd INTERFACE IMPORTED)
target_include_directories(libmicrohttpd INTERFACE ${MICROHTTPD_INCLUDE})
target_link_libraries(libmicrohttpd INTERFACE ${MICROHTTPD_LIBRARY})
