# Strict warnings for this package's own code.
function(bki_mapping_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
  if(BKI_MAPPING_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
    # A target whose definitions differ on some system, so that it cannot use the precompiled headers, is only compiled slower.
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -Wno-error=invalid-pch)
    endif()
  endif()
endfunction()

# Flags for the ROS shell.
set(BKI_MAPPING_SHELL_FLAGS "" CACHE STRING "More compiler flags for the ROS shell")
function(bki_mapping_shell_flags target)
  target_compile_options(${target} PRIVATE ${BKI_MAPPING_SHELL_FLAGS})
endfunction()
