# One directory two levels deep = one component = one static target = one row of tests/tools/layers.txt.

# smoothpost_add_component(kernels/smooth DEPENDS kernels/core Eigen3::Eigen PRIVATE some::library)
# [NO_PRECOMPILED]
# makes smoothpost_kernels_smooth and its alias smoothpost::kernels_smooth from the .cpp files there.
function(smoothpost_add_component path)
  cmake_parse_arguments(ARG "NO_PRECOMPILED" "" "DEPENDS;PRIVATE" ${ARGN})
  string(REPLACE "/" "_" name ${path})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${path}/*.cpp)
  set(links "")
  foreach(dependency ${ARG_DEPENDS})
    if(TARGET ${dependency})
      list(APPEND links ${dependency})
    else()
      string(REPLACE "/" "_" dependency_name ${dependency})
      list(APPEND links smoothpost_${dependency_name})
    endif()
  endforeach()
  if(sources)
    add_library(smoothpost_${name} STATIC ${sources})
    target_include_directories(smoothpost_${name} PUBLIC ${PROJECT_SOURCE_DIR})
    target_link_libraries(smoothpost_${name} PUBLIC ${links} PRIVATE ${ARG_PRIVATE})
    # Eigen and the standard library are most of every compilation: one precompiled header serves all
    # components, except those whose libraries bring compiler flags of their own (NO_PRECOMPILED).
    if(name STREQUAL "kernels_core")
      target_precompile_headers(smoothpost_${name} PRIVATE
        <Eigen/Geometry> <Eigen/LU> <algorithm> <array> <cmath> <map> <optional> <string> <string_view> <vector>)
    elseif(NOT ARG_NO_PRECOMPILED)
      target_precompile_headers(smoothpost_${name} REUSE_FROM smoothpost_kernels_core)
    endif()
  else()
    add_library(smoothpost_${name} INTERFACE)
    target_include_directories(smoothpost_${name} INTERFACE ${PROJECT_SOURCE_DIR})
    target_link_libraries(smoothpost_${name} INTERFACE ${links})
  endif()
  add_library(smoothpost::${name} ALIAS smoothpost_${name})
endfunction()

# smoothpost_add_tests(kernels/core [LINKS target ...]) makes test_kernels_core from tests/kernels/core/*_test.cpp
# and one CTest entry. The default run leaves [slow] cases out; `test_kernels_core "[slow]"` runs them.
function(smoothpost_add_tests path)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LINKS" ${ARGN})
  string(REPLACE "/" "_" name ${path})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${path}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  set(links ${ARG_LINKS})
  if(NOT links)
    set(links smoothpost_${name})
  endif()
  target_link_libraries(test_${name} PRIVATE ${links} smoothpost_test_support)
  # The same code model as the precompiled header's.
  set_target_properties(test_${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_precompile_headers(test_${name} REUSE_FROM smoothpost_test_support)
  add_test(NAME ${path} COMMAND test_${name} "~[slow]" WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  if(ARG_TIMEOUT)
    set_tests_properties(${path} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  endif()
endfunction()

# smoothpost_add_benchmark(reading LINKS target ...) makes bench_reading from tests/bench/reading_bench.cpp.
function(smoothpost_add_benchmark name)
  cmake_parse_arguments(ARG "" "" "LINKS" ${ARGN})
  if(NOT EXISTS ${PROJECT_SOURCE_DIR}/tests/bench/${name}_bench.cpp)
    return()
  endif()
  add_executable(bench_${name} ${PROJECT_SOURCE_DIR}/tests/bench/${name}_bench.cpp)
  target_link_libraries(bench_${name} PRIVATE ${ARG_LINKS} benchmark::benchmark)
  target_compile_definitions(bench_${name} PRIVATE
    SMOOTHPOST_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SMOOTHPOST_BINARY_DIR="${PROJECT_BINARY_DIR}")
endfunction()

# smoothpost_embed_files(postproc/report page FUNCTION page_asset): the files of postproc/report/page become bytes of
# that component, found by name: std::string_view smoothpost::page_asset(std::string_view name).
function(smoothpost_embed_files path folder)
  cmake_parse_arguments(ARG "" "FUNCTION" "" ${ARGN})
  string(REPLACE "/" "_" name ${path})
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${path}/${folder}/*)
  set(made ${PROJECT_BINARY_DIR}/${path}/${folder}_files.cpp)
  add_custom_command(OUTPUT ${made}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${made} -DFUNCTION=${ARG_FUNCTION} "-DFILES=${files}"
            -P ${PROJECT_SOURCE_DIR}/cmake/embed_files.cmake
    DEPENDS ${files} ${PROJECT_SOURCE_DIR}/cmake/embed_files.cmake VERBATIM)
  target_sources(smoothpost_${name} PRIVATE ${made})
  set_source_files_properties(${made} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()
