# SPDX-License-Identifier: MIT
# Cortex-M4F without an operating system. Test programs run in qemu-system-arm and print through
# semihosting; the product for the STM32F405 brings its own start-up.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffunction-sections -fdata-sections")
set(CMAKE_CROSSCOMPILING_EMULATOR ${CMAKE_CURRENT_LIST_DIR}/cortex-m4/run)

# Makes a test program of a target with a main(): start-up, memory map, newlib over semihosting.
function(cb_bare_metal target)
    set(folder ${CMAKE_SOURCE_DIR}/cmake/cortex-m4)
    target_sources(${target} PRIVATE ${folder}/start.c)
    target_link_options(${target} PRIVATE -nostartfiles --specs=rdimon.specs -Wl,--gc-sections
        -T${folder}/flash.ld)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${folder}/flash.ld SUFFIX .elf)
endfunction()
