# cmake -DBUILD=... -DSPLASH=... -DWORK=... -DCC=... -P build_splash.cmake
# Installs the C API into an empty directory, compiles the game against it with all warnings, and
# runs it.
file(REMOVE_RECURSE ${WORK})

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${result}\n${output}")
  endif()
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --component c_api --prefix ${WORK}/prefix)
file(GLOB sources ${SPLASH}/*.c)
run(${CC} -std=c11 -Wall -Wextra -Wpedantic -Werror -I${WORK}/prefix/include ${sources}
  -L${WORK}/prefix/lib -lliquidblend -Wl,-rpath,${WORK}/prefix/lib -lglfw -lepoxy -lm
  -o ${WORK}/splash)
run(${WORK}/splash --help)
