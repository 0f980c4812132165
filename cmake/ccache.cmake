# ccache, where it is installed (scripts/setup): compilers start through it, in every preset. Without it all builds the
# same, only slower. COMPBOX_CCACHE=OFF, or a launcher of one's own (CMAKE_CXX_COMPILER_LAUNCHER), keeps it away.
option(COMPBOX_CCACHE "compile through ccache, where it is installed" ON)
find_program(COMPBOX_CCACHE_PROGRAM ccache)
mark_as_advanced(COMPBOX_CCACHE_PROGRAM)
if(COMPBOX_CCACHE AND EXISTS "${COMPBOX_CCACHE_PROGRAM}")
    # Paths below the project count as relative, so that a fresh clone hits what another one compiled; times of headers
    # do not count, only what is in them, for which precompiled headers need it.
    set(launcher env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} CCACHE_NOHASHDIR=1
        CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${COMPBOX_CCACHE_PROGRAM})
    foreach(language C CXX)
        if(NOT CMAKE_${language}_COMPILER_LAUNCHER)
            set(CMAKE_${language}_COMPILER_LAUNCHER ${launcher})
        endif()
    endforeach()
endif()
