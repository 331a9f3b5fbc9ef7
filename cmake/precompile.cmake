# Precompiled headers: reading Eigen, ROS, PCL and GoogleTest takes most of the time of a build. With ccache they would
# only stand in the way.
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  set(BKI_MAPPING_PRECOMPILE OFF)
else()
  option(BKI_MAPPING_PRECOMPILE "Precompile the headers that most files read" ON)
endif()

# bki_mapping_precompile(TARGET header...), or bki_mapping_precompile(TARGET REUSE OTHER), if both have the same flags.
function(bki_mapping_precompile target)
  if(NOT BKI_MAPPING_PRECOMPILE)
    return()
  endif()
  if(ARGV1 STREQUAL "REUSE")
    target_precompile_headers(${target} REUSE_FROM ${ARGV2})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()
