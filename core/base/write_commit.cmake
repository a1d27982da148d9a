# Writes the source that holds the commit which programs are built from, unless it is there already.
#   cmake -DSOURCE_DIR=.. -DTEMPLATE=commit.cc.in -DOUTPUT=commit.cc -P write_commit.cmake
# LIQUIDBLEND_COMMIT of the environment wins over git's, for builds where there is no repository.
set(COMMIT "$ENV{LIQUIDBLEND_COMMIT}")
# Without a .git of its own the folder may lie in another project's repository.
if(NOT COMMIT AND EXISTS ${SOURCE_DIR}/.git)
  execute_process(
    COMMAND git --no-optional-locks describe --always --dirty --abbrev=12 --exclude=*
    WORKING_DIRECTORY ${SOURCE_DIR} OUTPUT_VARIABLE COMMIT ERROR_QUIET
    OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
if(NOT COMMIT)
  set(COMMIT unknown)
elseif(NOT COMMIT MATCHES "^[A-Za-z0-9._-]+$")
  message(FATAL_ERROR "LIQUIDBLEND_COMMIT: \"${COMMIT}\" is not letters, digits, '.', '_' and '-'")
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
