# libmosquitto: compbox-view speaks MQTT by it.
find_path(MOSQUITTO_INCLUDE mosquitto.h)
find_library(MOSQUITTO_LIBRARY mosquitto)
if(NOT MOSQUITTO_INCLUDE OR NOT MOSQUITTO_LIBRARY)
    message(FATAL_ERROR "libmosquitto is not there: scripts/setup installs it, for arm64 scripts/arm64-sysroot")
endif()
add_library(libmosquitto INTERFACE IMPORTED)
target_include_directories(libmosquitto INTERFACE ${MOSQUITTO_INCLUDE})
target_link_libraries(libmosquitto INTERFACE ${MOSQUITTO_LIBRARY})
