#include "hpsdf/detail/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hpsdf/error.h"

namespace hpsdf {
namespace memory_test {

TEST(Memory, bytesAreWrittenInASuitableUnit) {
  EXPECT_EQ(bytesText(0), "0 bytes");
  EXPECT_EQ(bytesText(999), "999 bytes");
  EXPECT_EQ(bytesText(1e3), "1.00 kB");
  EXPECT_EQ(bytesText(8.4e6), "8.40 MB");
  EXPECT_EQ(bytesText(2.345e12), "2345.00 GB");
}

TEST(Memory, requestsBeyondTheMachineAreRefused) {
  EXPECT_NO_THROW(requireMemory("a little", allowedMemory(), "take less"));
  try {
    requireMemory("a cloth", 1.01 * allowedMemory(), "take fewer nodes");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::limit);
    EXPECT_THAT(error.what(), testing::StartsWith("a cloth would take some "));
    EXPECT_THAT(error.what(), testing::EndsWith(": take fewer nodes"));
  }
}

}  // namespace memory_test
}  // namespace hpsdf
