// Tests the memory limits of Linux control groups (cgroups), read from files with the layout of /proc and /sys.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "hpsdf/detail/memory.h"
#include "support/temporary_directory.h"

namespace hpsdf {
namespace machine_memory_test {

class ControlGroups : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = root_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  double allowed() const { return detail::memoryOfControlGroups(root_.path()); }

  support::TemporaryDirectory root_;
};

TEST_F(ControlGroups, limitNothingWhereThereIsNoGroup) {
  EXPECT_EQ(allowed(), HUGE_VAL);
  write("proc/self/cgroup", "0::/\n");
  EXPECT_EQ(allowed(), HUGE_VAL) << "the group has no memory controller";
  write("proc/self/cgroup", "no group\n\n4:memory\n");
  EXPECT_EQ(allowed(), HUGE_VAL);
}

TEST_F(ControlGroups, ofVersion2LimitTheGroupsBelowThem) {
  write("proc/self/cgroup", "0::/user.slice/job 7\n");
  write("sys/fs/cgroup/user.slice/job 7/memory.max", "max\n");
  EXPECT_EQ(allowed(), HUGE_VAL);
  write("sys/fs/cgroup/user.slice/memory.max", "3000000000\n");
  EXPECT_EQ(allowed(), 3e9);
  write("sys/fs/cgroup/user.slice/job 7/memory.max", "2000000000\n");
  EXPECT_EQ(allowed(), 2e9);
  write("sys/fs/cgroup/user.slice/job 8/memory.max", "1000000000\n");
  EXPECT_EQ(allowed(), 2e9) << "the limit of another group does not count";
}

TEST_F(ControlGroups, ofVersion1LimitTheirController) {
  write("proc/self/cgroup", "5:cpu,cpuacct:/few\n4:hugetlb,memory:/job\n1:name=memory:/few\n0::/\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  write("sys/fs/cgroup/memory/few/memory.limit_in_bytes", "1000\n");
  write("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "4000000000\n");
  EXPECT_EQ(allowed(), 4e9);
}

/// In a container, the process's own group folder is invisible; the topmost visible folder is the container's group.
TEST_F(ControlGroups, ofAContainerAreSeenFromWithin) {
  write("sys/fs/cgroup/memory.max", "500000000\n");
  for (const char* group : {"/", "/docker/0123", "/../other"}) {
    write("proc/self/cgroup", std::string("0::") + group + "\n");
    EXPECT_EQ(allowed(), 5e8) << group;
  }
}

TEST(MachineMemory, isFiniteAndWithinTheGroupsLimit) {
  EXPECT_GT(detail::machineMemory(), 0);
  EXPECT_LT(detail::machineMemory(), HUGE_VAL);
  EXPECT_LE(detail::machineMemory(), detail::memoryOfControlGroups());
}

}  // namespace machine_memory_test
}  // namespace hpsdf
