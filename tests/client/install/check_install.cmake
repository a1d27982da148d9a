# cmake -DBUILD=... -DSOURCE=... -DWORK=... -DCXX=... -DFLAGS=... -P check_install.cmake
# Installs the client into an empty directory, then builds and runs a program that uses it.
file(REMOVE_RECURSE ${WORK})

include(${CMAKE_CURRENT_LIST_DIR}/../run.cmake)

foreach(component client library dev)
  run(${CMAKE_COMMAND} --install ${BUILD} --component ${component} --prefix ${WORK}/prefix)
endforeach()
run(${WORK}/prefix/bin/liquidblend --help)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix
  -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)

# The C API, from the same prefix, in C++17; then from a prefix that has nothing else.
function(check_c_api prefix)
  separate_arguments(flags UNIX_COMMAND "${FLAGS}")
  run(${CXX} ${flags} -std=c++17 -Wall -Wextra -Wpedantic -Wconversion -Werror
    -I${prefix}/include ${SOURCE}/c_api.cc -L${prefix}/lib -lliquidblend
    -Wl,-rpath,${prefix}/lib -o ${WORK}/c_api)
  run(${WORK}/c_api)
endfunction()
check_c_api(${WORK}/prefix)
run(${CMAKE_COMMAND} --install ${BUILD} --component c_api --prefix ${WORK}/c_prefix)
check_c_api(${WORK}/c_prefix)
file(GLOB_RECURSE installed RELATIVE ${WORK}/c_prefix LIST_DIRECTORIES false ${WORK}/c_prefix/*)
list(FILTER installed EXCLUDE REGEX "^lib/libliquidblend[.]so")
if(NOT installed STREQUAL "include/liquidblend/liquidblend.h")
  message(FATAL_ERROR "the component c_api has ${installed}")
endif()

file(GLOB_RECURSE headers ${WORK}/prefix/include/*)
foreach(header ${headers})
  file(READ ${header} text)
  if(text MATCHES "grpc|[.]pb[.]h|Eigen")
    message(FATAL_ERROR "${header} names grpc, generated code or Eigen")
  endif()
endforeach()

# The Python package finds the library beside it. A sanitizer's runtime is not in Python.
find_program(DEBIAN_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(DEBIAN_PYTHON AND NOT FLAGS)
  run(${CMAKE_COMMAND} --install ${BUILD} --component python --prefix ${WORK}/python_prefix)
  set(ENV{PYTHONPATH} ${WORK}/python_prefix/share/liquidblend/python)
  unset(ENV{LIQUIDBLEND_LIBRARY})
  run(${DEBIAN_PYTHON} -B -c "import liquidblend; print(liquidblend.library_version())")
endif()
