# For CPack, before it packs: programs without their compilers' names, as dh_strip leaves them.
file(GLOB programs ${CPACK_TEMPORARY_DIRECTORY}/*/usr/bin/* ${CPACK_TEMPORARY_DIRECTORY}/*/usr/sbin/*)
foreach(program ${programs})
    file(READ ${program} magic LIMIT 4 HEX)
    if(magic STREQUAL "7f454c46")
        execute_process(COMMAND ${CPACK_COMPBOX_STRIP} --remove-section=.comment --remove-section=.note ${program}
            COMMAND_ERROR_IS_FATAL ANY)
    endif()
endforeach()
