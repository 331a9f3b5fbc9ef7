# Strict warnings for this package's own code.
function(bki_mapping_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
  if(BKI_MAPPING_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# Flags for the ROS shell.
set(BKI_MAPPING_SHELL_FLAGS "" CACHE STRING "More compiler flags for the ROS shell")
function(bki_mapping_shell_flags target)
  target_compile_options(${target} PRIVATE ${BKI_MAPPING_SHELL_FLAGS})
endfunction()
