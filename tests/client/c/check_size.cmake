# cmake -DLIBRARY=... -DMAX_BYTES=... -P check_size.cmake
# Whether the library is no larger than that: it goes into games.
file(REAL_PATH ${LIBRARY} file)
file(SIZE ${file} bytes)
message(STATUS "${file}: ${bytes} bytes")
if(bytes GREATER MAX_BYTES)
  message(FATAL_ERROR "more than ${MAX_BYTES} bytes: what did it begin to link?")
endif()
