# Debian packages by CPack: compboxd (daemon), compbox-view (its page) and compbox (host tools), for amd64 by the preset host, for arm64
# by arm64-tools. scripts/packages makes and tests them; docs/packages.md.
include(GNUInstallDirs)
set(packaging ${CMAKE_SOURCE_DIR}/packaging)

# cb_documents(COMPONENT FILE…): with what Debian wants of every package, changelog and copyright.
function(cb_documents component)
    set(folder share/doc/${component})
    set(changelog ${CMAKE_BINARY_DIR}/packaging/${component}/changelog.gz)
    file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/packaging/${component})
    execute_process(COMMAND gzip -9nc ${CMAKE_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${changelog})
    set(debian ${CMAKE_BINARY_DIR}/packaging/${component}/changelog.Debian)
    string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
    file(WRITE ${debian} "${component} (${PROJECT_VERSION}-1) unstable; urgency=medium\n\n  * Version ${PROJECT_VERSION}; see changelog.gz.\n\n -- The compbox authors <maintainers@users.noreply.github.com>  ${date}\n")
    execute_process(COMMAND gzip -9nc ${debian} OUTPUT_FILE ${debian}.gz)
    install(FILES ${changelog} ${debian}.gz DESTINATION ${folder} COMPONENT ${component})
    set(copyright ${CMAKE_BINARY_DIR}/packaging/${component}/copyright)
    file(READ ${packaging}/debian/copyright text)
    if(EXISTS ${packaging}/debian/copyright.${component}) # the licences of what is compiled into its programs
        file(READ ${packaging}/debian/copyright.${component} others)
        string(APPEND text "${others}")
    endif()
    file(WRITE ${copyright} "${text}")
    install(FILES ${copyright} DESTINATION ${folder} COMPONENT ${component})
    install(FILES ${ARGN} DESTINATION ${folder} COMPONENT ${component})
    install(FILES ${packaging}/debian/${component}.lintian-overrides DESTINATION share/lintian/overrides
        RENAME ${component} COMPONENT ${component})
endfunction()

# Man pages come from the programs' own help (packaging/manual.py). A cross build takes those of the preset host, so
# no foreign program runs.
if(CMAKE_CROSSCOMPILING)
    set(manual ${CMAKE_SOURCE_DIR}/build/host/manual)
else()
    set(manual ${CMAKE_BINARY_DIR}/manual)
    set(make_manual ${packaging}/manual.py ${PROJECT_VERSION} ${manual})
    add_custom_target(manual VERBATIM
        COMMAND ${make_manual}/compbox 1 $<TARGET_FILE:compbox> $<TARGET_FILE:fakeplc> $<TARGET_FILE:fakept100>
            $<TARGET_FILE:virtual-laser> ${packaging}/compbox-demo
        COMMAND ${make_manual}/compboxd 8 $<TARGET_FILE:compboxd>
        COMMAND ${make_manual}/compbox-view 1 $<TARGET_FILE:compbox-view>)
endif()

# cb_manual(COMPONENT)
function(cb_manual component)
    install(DIRECTORY ${manual}/${component}/ DESTINATION share/man COMPONENT ${component})
endfunction()

# cb_service(PACKAGE): its unit, options, group, and the scripts of its installation
function(cb_service package)
    install(FILES ${packaging}/${package}.service DESTINATION /lib/systemd/system COMPONENT ${package})
    install(FILES ${packaging}/${package}.default DESTINATION /etc/default RENAME ${package} COMPONENT ${package})
    install(FILES ${packaging}/compbox.sysusers DESTINATION /usr/lib/sysusers.d RENAME ${package}.conf
        COMPONENT ${package})
    set(control ${packaging}/debian/${package}/conffiles)
    foreach(script postinst prerm postrm)
        set(made ${CMAKE_BINARY_DIR}/packaging/${package}/${script})
        configure_file(${packaging}/debian/${script} ${made} @ONLY USE_SOURCE_PERMISSIONS)
        list(APPEND control ${made})
    endforeach()
    string(TOUPPER ${package} name)
    set(CPACK_DEBIAN_${name}_PACKAGE_CONTROL_EXTRA ${control} PARENT_SCOPE)
endfunction()

install(TARGETS compboxd RUNTIME DESTINATION sbin COMPONENT compboxd)
cb_service(compboxd)
install(DIRECTORY DESTINATION /etc/compbox/keys COMPONENT compboxd)
cb_documents(compboxd docs/compboxd.md docs/coefficient-file.md docs/faults.md)
cb_manual(compboxd)
set(CPACK_COMPONENTS_ALL compboxd compbox-view compbox)

install(TARGETS compbox-view RUNTIME DESTINATION bin COMPONENT compbox-view)
cb_service(compbox-view)
cb_documents(compbox-view docs/view.md docs/uplink.md docs/snapshot.md docs/events.md)
cb_manual(compbox-view)

install(TARGETS compbox fakeplc fakept100 virtual-laser RUNTIME DESTINATION bin COMPONENT compbox)
install(PROGRAMS ${packaging}/compbox-demo DESTINATION bin COMPONENT compbox)
install(FILES docs/coefficients.schema.json DESTINATION share/compbox COMPONENT compbox)
install(DIRECTORY host-tools/fleet DESTINATION share/compbox COMPONENT compbox PATTERN __pycache__ EXCLUDE)
# compbox-demo needs the examples, and Debian's policy permits a system without /usr/share/doc.
install(DIRECTORY examples DESTINATION share/compbox COMPONENT compbox PATTERN LICENSE EXCLUDE)
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/packaging/compbox)
file(CREATE_LINK ../../compbox/examples ${CMAKE_BINARY_DIR}/packaging/compbox/examples SYMBOLIC)
install(FILES ${CMAKE_BINARY_DIR}/packaging/compbox/examples DESTINATION share/doc/compbox COMPONENT compbox)
cb_documents(compbox README.md docs/coefficient-file.md docs/coefficients.schema.json docs/fakeplc.md)
cb_manual(compbox)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "compbox")
set(CPACK_PACKAGE_CONTACT "The compbox authors <maintainers@users.noreply.github.com>")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPBOX_STRIP ${CMAKE_STRIP})
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/strip.cmake)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ
    GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPBOXD_PACKAGE_NAME compboxd)
set(CPACK_DEBIAN_COMPBOXD_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_COMPBOX_PACKAGE_NAME compbox)
set(CPACK_DEBIAN_COMPBOX_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMPBOXD_DESCRIPTION "compensation of a machine tool, the box
Reads positions and temperatures of a machine tool every 30 ms, computes its
error from models in a coefficient file, and writes the compensation to the
PLC over Modbus.")
set(CPACK_DEBIAN_COMPBOX_DESCRIPTION "compensation of a machine tool, the tools
Makes the coefficient file of a compbox from measurements: fits curves,
identifies volumetric errors, trains thermal models, simulates what comes out.")
set(CPACK_DEBIAN_COMPBOX-VIEW_PACKAGE_NAME compbox-view)
set(CPACK_DEBIAN_COMPBOX-VIEW_PACKAGE_SECTION electronics)
set(CPACK_DEBIAN_COMPBOX-VIEW_DESCRIPTION "compensation of a machine tool, the page
Serves what compboxd does as a page for browsers, as JSON, and as metrics for
Prometheus. It reads the files of compboxd and writes nothing.")
set(CPACK_DEBIAN_COMPBOX-VIEW_PACKAGE_RECOMMENDS "compboxd")
set(CPACK_DEBIAN_COMPBOXD_PACKAGE_RECOMMENDS "iproute2")
set(CPACK_DEBIAN_COMPBOX_PACKAGE_RECOMMENDS "gnuplot-nox | gnuplot")
set(CPACK_DEBIAN_COMPBOX_PACKAGE_SUGGESTS "compboxd, compbox-view, python3, python3-distributed, python3-paho-mqtt") # for compbox-demo and compbox fleet
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
if(CMAKE_SYSROOT) # whose libraries are in packages that the host's dpkg does not know
    set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
    set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_SYSROOT}/lib/aarch64-linux-gnu)
    file(WRITE ${CMAKE_BINARY_DIR}/packaging/database.cmake
        "set(ENV{DPKG_ADMINDIR} ${CMAKE_SYSROOT}/var/lib/dpkg)\nset(ENV{DEB_HOST_ARCH} arm64)\n")
    set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_BINARY_DIR}/packaging/database.cmake)
endif()
include(CPack)
