# Installs the build HPSDF_BUILD_DIR under a prefix of its own, configures the project beside this script against it,
# builds it and runs its program. Starts from nothing, so that no earlier installation can lend what this one lacks.
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
  -D EXPECT_RENDER=${EXPECT_RENDER})
run(${CMAKE_COMMAND} --build ${build_dir} --config ${CONFIG})
run(${CMAKE_COMMAND} --build ${build_dir} --config ${CONFIG} --target run)
