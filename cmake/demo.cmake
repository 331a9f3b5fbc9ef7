# What scripts/demo builds: what it runs itself, and what the commands and programs of README.md, docs/install.md and
# docs/start.md need. commands_test types the commands of these pages where nothing else is built.
set(BKI_MAPPING_DEMO_TARGETS
  bki_mapping_nodelets bki_mapping_generate_messages_py bki_mapping_gencfg bki_mapping_python
  clear_map export_map inspect_map map_sequence merge_maps play_sequence simulate_drive)
add_custom_target(bki_mapping_demo)
foreach(target ${BKI_MAPPING_DEMO_TARGETS})
  if(TARGET ${target})  # the Python module is left out without pybind11
    add_dependencies(bki_mapping_demo ${target})
  endif()
endforeach()
