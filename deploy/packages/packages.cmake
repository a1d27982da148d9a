# The Debian packages that cpack makes of the components.
set(LIQUIDBLEND_MAINTAINER "liquidblend maintainers <maintainers@liquidblend.invalid>" CACHE STRING
  "Who answers for the Debian packages: NAME <ADDRESS>")
set(LIQUIDBLEND_PACKAGE_RELEASE 1 CACHE STRING "Revision of the Debian packages of one version")

set(package_server liquidblend-server)
set(package_worker liquidblend-worker)
set(package_client liquidblend-client)
set(package_library libliquidblend1)
set(package_dev libliquidblend-dev)
set(package_python3 python3-liquidblend)
set(package_examples liquidblend-examples)
set(package_documentation liquidblend-doc)
set(components server worker client library dev python3 examples documentation)

set(changelog ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian.gz)
set(release ${PROJECT_VERSION}-${LIQUIDBLEND_PACKAGE_RELEASE})
execute_process(
  COMMAND ${LIQUIDBLEND_PYTHON} ${CMAKE_CURRENT_SOURCE_DIR}/debian_changelog.py
    ${CMAKE_SOURCE_DIR}/docs/changelog.md ${release} ${LIQUIDBLEND_MAINTAINER} ${changelog}
  COMMAND_ERROR_IS_FATAL ANY)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS debian_changelog.py
  ${CMAKE_SOURCE_DIR}/docs/changelog.md)
foreach(component server worker library)
  install(FILES ${component}/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides
    RENAME ${package_${component}} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
foreach(component ${components})
  install(FILES copyright ${changelog}
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package_${component}}
    COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()

# lb_package(COMPONENT SECTION SUMMARY DESCRIPTION [DEPENDS text] [RECOMMENDS text] [SUGGESTS text]
#            [ALL] [CONTROL files..])
#   ALL      the same for each architecture
#   CONTROL  scripts of the package and lists, in the folder COMPONENT
macro(lb_package component section summary description)
  cmake_parse_arguments(ARG "ALL" "DEPENDS;RECOMMENDS;SUGGESTS" "CONTROL" ${ARGN})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package_${component}})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${ARG_DEPENDS}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_RECOMMENDS "${ARG_RECOMMENDS}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_SUGGESTS "${ARG_SUGGESTS}")
  if(ARG_ALL)
    set(CPACK_DEBIAN_${upper}_PACKAGE_ARCHITECTURE all)
  endif()
  set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "")
  foreach(file ${ARG_CONTROL})
    configure_file(${component}/${file} ${component}/${file} @ONLY)
    list(APPEND CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA
      ${CMAKE_CURRENT_BINARY_DIR}/${component}/${file})
  endforeach()
endmacro()

set(about "liquidblend registers simulations of one scene to one another, and answers
blend weights and a time with the liquid's surface in milliseconds.
")
lb_package(server graphics "blends of liquid simulations - server" "${about}
The server, started by systemd on the loopback interface, its page for
browsers, and liquidblend-admin, which looks after its store."
  DEPENDS "liquidblend-worker (= ${release})" RECOMMENDS "liquidblend-client, liquidblend-doc"
  SUGGESTS "liquidblend-examples, postgresql" CONTROL conffiles postinst postrm prerm)
lb_package(worker graphics "blends of liquid simulations - worker" "${about}
The program that imports and registers simulations. A server starts its own;
on machines without one, systemd does."
  DEPENDS "systemd-standalone-sysusers | systemd-sysusers"
  RECOMMENDS "ca-certificates, liquidblend-doc" CONTROL conffiles postinst postrm prerm)
lb_package(client graphics "blends of liquid simulations - command" "${about}
The command liquidblend, which imports and registers simulations, writes
frames and exports animations."
  RECOMMENDS "ca-certificates" SUGGESTS "liquidblend-doc, liquidblend-examples, liquidblend-server")
lb_package(library libs "blends of liquid simulations - C library" "${about}
The library with the C API, for games and other programs that play frames."
  CONTROL shlibs triggers)
lb_package(dev libdevel "blends of liquid simulations - headers" "${about}
Headers of the C API and of the C++ client, and what CMake needs to find them."
  DEPENDS "libliquidblend1 (= ${release}), libabsl-dev, libcurl4-openssl-dev, libdraco-dev, \
libgrpc++-dev, libmeshoptimizer-dev, libprotobuf-dev, libssl-dev, protobuf-compiler-grpc")
lb_package(python3 python "blends of liquid simulations - Python package" "${about}
Frames as numpy arrays, and a file from which Blender installs an add-on."
  DEPENDS "libliquidblend1 (>= ${PROJECT_VERSION}), python3:any (>= 3.9), python3-numpy" ALL
  CONTROL postinst prerm)
lb_package(examples graphics "blends of liquid simulations - two simulations to try" "${about}
Two drops that fall into a pool, simulated twice, to be imported and
registered." ALL)
lb_package(documentation doc "blends of liquid simulations - documentation" "${about}
The pages for users, operators and programmers." ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGE_NAME liquidblend)
set(CPACK_PACKAGE_CONTACT ${LIQUIDBLEND_MAINTAINER})
set(CPACK_DEBIAN_PACKAGE_RELEASE ${LIQUIDBLEND_PACKAGE_RELEASE})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # /etc lies outside of the prefix
set(CPACK_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_VERBATIM_VARIABLES ON)
include(CPack)
