# find_package(liquidblend) gives the target liquidblend::liquidblend.
include(CMakeFindDependencyMacro)
find_dependency(Threads)
find_dependency(absl CONFIG)
# Protobuf in module mode before gRPC: Debian ships no protobuf-config.cmake.
find_dependency(Protobuf MODULE)
find_dependency(gRPC CONFIG)
find_dependency(CURL)
find_dependency(OpenSSL)
find_dependency(draco CONFIG)
include(${CMAKE_CURRENT_LIST_DIR}/liquidblendTargets.cmake)
