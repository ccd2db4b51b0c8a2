// What control groups allow, by files as Linux has them.
#include "util/machine_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "support/temporary_directory.h"

namespace hpsdf {
namespace {

class ControlGroups : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = root_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  double allowed() const { return memoryOfControlGroups(root_.path()); }

  support::TemporaryDirectory root_;
};

TEST_F(ControlGroups, LimitNothingWhereThereAreNone) {
  EXPECT_EQ(allowed(), HUGE_VAL);
  write("proc/self/cgroup", "0::/\n");
  EXPECT_EQ(allowed(), HUGE_VAL) << "no controller of memory";
  write("proc/self/cgroup", "no group\n\n4:memory\n");
  EXPECT_EQ(allowed(), HUGE_VAL);
}

TEST_F(ControlGroups, OfVersion2LimitWhatIsBelowThem) {
  write("proc/self/cgroup", "0::/user.slice/job 7\n");
  write("sys/fs/cgroup/user.slice/job 7/memory.max", "max\n");
  EXPECT_EQ(allowed(), HUGE_VAL);
  write("sys/fs/cgroup/user.slice/memory.max", "3000000000\n");
  EXPECT_EQ(allowed(), 3e9);
  write("sys/fs/cgroup/user.slice/job 7/memory.max", "2000000000\n");
  EXPECT_EQ(allowed(), 2e9);
  write("sys/fs/cgroup/user.slice/job 8/memory.max", "1000000000\n");
  EXPECT_EQ(allowed(), 2e9) << "another's";
}

TEST_F(ControlGroups, OfVersion1LimitToo) {
  write("proc/self/cgroup", "5:cpu,cpuacct:/few\n4:hugetlb,memory:/job\n1:name=memory:/few\n0::/\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  write("sys/fs/cgroup/memory/few/memory.limit_in_bytes", "1000\n");
  write("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "4000000000\n");
  EXPECT_EQ(allowed(), 4e9);
}

/// The group's own folder is out of sight; what is seen as the topmost is it.
TEST_F(ControlGroups, OfAContainerAreSeenFromWithin) {
  write("sys/fs/cgroup/memory.max", "500000000\n");
  for (const char* group : {"/", "/docker/0123", "/../other"}) {
    write("proc/self/cgroup", std::string("0::") + group + "\n");
    EXPECT_EQ(allowed(), 5e8) << group;
  }
}

TEST(MachineMemory, IsSome) {
  EXPECT_GT(machineMemory(), 0);
  EXPECT_LT(machineMemory(), HUGE_VAL);
  EXPECT_LE(machineMemory(), memoryOfControlGroups());
}

}  // namespace
}  // namespace hpsdf
