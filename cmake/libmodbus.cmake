# libmodbus: compbox needs it for `plc`; compboxd has its client "libmodbus" where it is found. A cross compiler without
# a sysroot of its own has none.
if(NOT CMAKE_CROSSCOMPILING OR CMAKE_SYSROOT)
    find_path(MODBUS_INCLUDE modbus/modbus.h)
    find_library(MODBUS_LIBRARY modbus)
endif()
if(MODBUS_INCLUDE AND MODBUS_LIBRARY)
    add_library(libmodbus INTERFACE IMPORTED)
    target_include_directories(libmodbus INTERFACE ${MODBUS_INCLUDE})
    target_link_libraries(libmodbus INTERFACE ${MODBUS_LIBRARY})
elseif(NOT COMPBOX_CORE_ONLY)
    message(FATAL_ERROR "libmodbus is not there: scripts/setup installs it, for arm64 scripts/arm64-sysroot")
endif()
