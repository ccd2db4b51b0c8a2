# Triangles of Bullet's, where it is there, touch in the very places in which ours do, and most of the 20,000 samples are
# passed over unseen: -D PROGRAM=…
if(NOT DEFINED ENV{HPSDF_MESHES})
  message("skipped: HPSDF_MESHES is not set to a folder of test meshes")
  return()
endif()
execute_process(
  COMMAND ${PROGRAM} --benchmark_filter=^contacts/\(touching|apart\)/ --benchmark_min_time=0.001 --benchmark_format=json
  OUTPUT_VARIABLE json
  COMMAND_ERROR_IS_FATAL ANY)
string(JSON count LENGTH "${json}" benchmarks)
if(count LESS 2)
  message(FATAL_ERROR "only ${count} benchmarks have been run")
endif()
math(EXPR last "${count} - 1")
foreach(i RANGE ${last})
  string(JSON name GET "${json}" benchmarks ${i} name)
  string(JSON failed ERROR_VARIABLE none GET "${json}" benchmarks ${i} error_message)
  if(NOT none)
    message(SEND_ERROR "${name}: ${failed}")
  elseif(name MATCHES "ours$")
    string(JSON spheres GET "${json}" benchmarks ${i} spheres)
    string(JSON samples GET "${json}" benchmarks ${i} samples)
    if(NOT spheres LESS 500 OR NOT samples LESS 1000)
      message(SEND_ERROR "${name}: ${spheres} spheres and ${samples} samples were looked up in one place")
    endif()
  endif()
endforeach()
