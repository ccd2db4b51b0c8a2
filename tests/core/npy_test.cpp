#include "arrays/npy.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hpsdf {
namespace npy_test {

using arrays::NamedArray;

template <typename Write>
std::string bytesOf(const Write& write) {
  std::string bytes;
  write(
      [&](std::span<const std::byte> more) { bytes.append(reinterpret_cast<const char*>(more.data()), more.size()); });
  return bytes;
}

std::string npyOf(const arrays::ArrayView& array) {
  return bytesOf([&](const arrays::WriteBytes& write) { arrays::writeNpy(array, write); });
}

std::string npzOf(std::span<const NamedArray> arrays) {
  return bytesOf([&](const arrays::WriteBytes& write) { arrays::writeNpz(arrays, write); });
}

/// Returns the number of `size` bytes at `at`, the lowest byte first.
std::uint64_t numberAt(const std::string& bytes, std::size_t at, int size) {
  std::uint64_t number = 0;
  for (int i = size; i-- > 0;) number = number << 8 | static_cast<unsigned char>(bytes.at(at + std::size_t(i)));
  return number;
}

std::string headerText(const std::string& npy) { return npy.substr(10, numberAt(npy, 8, 2)); }

TEST(Npy, describesTypeAndShapeInAHeaderOfWholeLines) {
  const std::vector<float> numbers = {1, 2, 3, 4, 5, 6};
  const std::string npy = npyOf(arrays::viewOf(std::span(numbers), {2, 3}));
  EXPECT_EQ(npy.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::string header = headerText(npy);
  EXPECT_TRUE(header.starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }")) << header;
  EXPECT_EQ(header.back(), '\n');
  const std::size_t start = 10 + header.size();
  EXPECT_EQ(start % 64, 0u) << "the numbers are aligned";
  ASSERT_EQ(npy.size(), start + sizeof(float) * numbers.size());
  EXPECT_EQ(std::memcmp(npy.data() + start, numbers.data(), sizeof(float) * numbers.size()), 0);
}

TEST(Npy, writesShapesOfOneAndNoDimensionAsTuples) {
  const std::vector<std::uint8_t> numbers = {7};
  const auto shapeOf = [&](std::vector<std::size_t> shape) {
    return headerText(npyOf(arrays::viewOf(std::span(numbers), std::move(shape))));
  };
  EXPECT_TRUE(shapeOf({1}).starts_with("{'descr': '|u1', 'fortran_order': False, 'shape': (1,), }"));
  EXPECT_TRUE(shapeOf({}).starts_with("{'descr': '|u1', 'fortran_order': False, 'shape': (), }"));
  EXPECT_TRUE(shapeOf({1, 1, 1}).starts_with("{'descr': '|u1', 'fortran_order': False, 'shape': (1, 1, 1), }"));
}

TEST(Npy, writesArchivesWhoseDirectoryLeadsToEachFile) {
  std::vector<double> many(300'000);  // more than one piece of the checksum
  std::iota(many.begin(), many.end(), 0.5);
  const std::vector<std::uint32_t> few = {3, 1};
  const std::vector<NamedArray> arrays = {{"many", arrays::viewOf(std::span(std::as_const(many)), {100'000, 3})},
                                          {"none", arrays::viewOf(std::span<const float>(), {0, 3})},
                                          {"few", arrays::viewOf(std::span(few), {2})}};
  const std::string npz = npzOf(arrays);
  const std::size_t end = npz.size() - 22;
  ASSERT_EQ(numberAt(npz, end, 4), 0x06054b50u);
  EXPECT_EQ(numberAt(npz, end + 10, 2), arrays.size());
  std::size_t at = numberAt(npz, end + 16, 4);
  EXPECT_EQ(at + numberAt(npz, end + 12, 4), end);
  for (const auto& [name, array] : arrays) {
    ASSERT_EQ(numberAt(npz, at, 4), 0x02014b50u);
    const std::uint64_t size = numberAt(npz, at + 24, 4), nameSize = numberAt(npz, at + 28, 2);
    EXPECT_EQ(npz.substr(at + 46, nameSize), name + ".npy");
    const std::size_t local = numberAt(npz, at + 42, 4);
    ASSERT_EQ(numberAt(npz, local, 4), 0x04034b50u);
    EXPECT_EQ(npz.substr(local + 14, 12), npz.substr(at + 16, 12)) << "checksum and sizes";
    const std::string content = npz.substr(local + 30 + nameSize, size);
    EXPECT_EQ(content, npyOf(array));
    EXPECT_EQ(numberAt(npz, at + 16, 4), crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()));
    at += 46 + nameSize;
  }
  EXPECT_EQ(at, end);
}

}  // namespace npy_test
}  // namespace hpsdf
