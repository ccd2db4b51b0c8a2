# Installs the build HPSDF_BUILD_DIR under a prefix of its own, configures the project beside this script against it,
# builds it and runs its programs. Does the same with the project in C, and once more by pkg-config alone. Starts from
# nothing, so that no earlier installation can lend what this one lacks.
set(work_dir ${HPSDF_BUILD_DIR}/tests/consumer)
set(prefix ${work_dir}/prefix)
set(build_dir ${work_dir}/build)
file(REMOVE_RECURSE ${work_dir})

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${HPSDF_BUILD_DIR} --config ${CONFIG} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${build_dir} -G ${GENERATOR}
  -D CMAKE_CXX_COMPILER=${CXX_COMPILER}
  -D CMAKE_BUILD_TYPE=${CONFIG}
  -D CMAKE_PREFIX_PATH=${prefix}
  -D EXPECT_PHYSICS=${EXPECT_PHYSICS}
  -D EXPECT_BULLET=${EXPECT_BULLET}
  -D EXPECT_OPENVDB=${EXPECT_OPENVDB}
  -D EXPECT_MPI=${EXPECT_MPI}
  -D EXPECT_RENDER=${EXPECT_RENDER})
run(${CMAKE_COMMAND} --build ${build_dir} --config ${CONFIG})
run(${CMAKE_COMMAND} --build ${build_dir} --config ${CONFIG} --target run)

if(NOT EXPECT_C)
  return()
endif()
set(c_build_dir ${work_dir}/build-c)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/c -B ${c_build_dir} -G ${GENERATOR}
  -D CMAKE_C_COMPILER=${C_COMPILER}
  -D CMAKE_BUILD_TYPE=${CONFIG}
  -D CMAKE_PREFIX_PATH=${prefix})
run(${CMAKE_COMMAND} --build ${c_build_dir} --config ${CONFIG} --target run)

set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
execute_process(COMMAND pkg-config --cflags --libs hpsdf
  OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
if(SANITIZE)
  list(APPEND flags -fsanitize=${SANITIZE})
endif()
run(${C_COMPILER} -std=c99 -Wall -Wextra -pedantic -Werror ${CMAKE_CURRENT_LIST_DIR}/c/use_c.c
  ${flags} -Wl,-rpath,${prefix}/${LIBDIR} -o ${c_build_dir}/use_c_by_pkg_config)
run(${c_build_dir}/use_c_by_pkg_config)
