# SPDX-License-Identifier: Apache-2.0
# For CMAKE_PROJECT_INCLUDE, when building on the ROS wheels: the targets they export name include folders of the
# machine that built the wheels (/opt/python/...), and CMake refuses an imported target whose include folder is missing.
# Deferred to the end of the top folder's CMakeLists.txt, so after every find_package, and without touching that file.
function(strip_missing_includes)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(NOT folders)
      continue()
    endif()
    set(kept "")
    foreach(folder IN LISTS folders)
      if(EXISTS "${folder}" OR folder MATCHES "^\\$<")
        list(APPEND kept "${folder}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${kept}")
  endforeach()
endfunction()

cmake_language(DEFER CALL strip_missing_includes)
