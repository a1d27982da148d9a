# cmake -DBUILD=... -DSPLASH=... -DWORK=... -DCC=... -P build_splash.cmake
# Installs the C API into an empty directory, compiles the game against it with all warnings, and
# runs it.
file(REMOVE_RECURSE ${WORK})

include(${CMAKE_CURRENT_LIST_DIR}/../run.cmake)

run(${CMAKE_COMMAND} --install ${BUILD} --component c_api --prefix ${WORK}/prefix)
file(GLOB sources ${SPLASH}/*.c)
run(${CC} -std=c11 -Wall -Wextra -Wpedantic -Werror -I${WORK}/prefix/include ${sources}
  -L${WORK}/prefix/lib -lliquidblend -Wl,-rpath,${WORK}/prefix/lib -lglfw -lepoxy -lm
  -o ${WORK}/splash)
run(${WORK}/splash --help)
