# The server under a simulated clock, disk and machine. It exports the functions of the C library
# that it replaces to the shared libraries that it uses; sanitizers replace the same ones.
if(TARGET server_lib AND NOT TESSERA_SANITIZE)
  add_executable(simulation
    simulation/broker.cpp
    simulation/comparisons.cpp
    simulation/copier.cpp
    simulation/damage.cpp
    simulation/disk.cpp
    simulation/executor.cpp
    simulation/faults.cpp
    simulation/ledger.cpp
    simulation/life.cpp
    simulation/machine.cpp
    simulation/main.cpp
    simulation/model.cpp
    simulation/operators.cpp
    simulation/receiver.cpp
    simulation/requests.cpp
    simulation/watch.cpp
    simulation/wire.cpp
    simulation/workers.cpp)
  set_target_properties(simulation PROPERTIES ENABLE_EXPORTS ON)
  target_link_options(simulation PRIVATE  # tests/simulation/model.cpp
    LINKER:--wrap=_ZN4core8Renderer6createENS_4ViewE
    LINKER:--wrap=_ZN4core6settleB5cxx11ERNS_4ViewERKNS_9StopRulesERKSt10stop_token)
  target_link_libraries(simulation PRIVATE tessera_flags server_lib)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_link_options(simulation PRIVATE -fno-lto)
  endif()
endif()
