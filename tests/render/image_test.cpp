#include "hpsdf/render/image.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "hpsdf/error.h"
#include "support/message_of.h"
#include "support/temporary_directory.h"

namespace hpsdf::render {
namespace image_test {

using support::messageOf;
using support::TemporaryDirectory;

Image noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  Image image(width, height, Color{});
  for (Color& pixel : image.pixels)
    for (auto& channel : pixel) channel = static_cast<std::uint8_t>(random());
  return image;
}

std::string bytesOf(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Image, returnsUnchangedFromPng) {
  const TemporaryDirectory directory;
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 7}, {257, 31}}) {
    const Image image = noise(width, height, 11);
    savePng(image, directory / "a.png");
    const Image again = loadPng(directory / "a.png");
    EXPECT_EQ(again.width, width);
    EXPECT_EQ(again.height, height);
    EXPECT_EQ(again.pixels, image.pixels);
  }
}

TEST(Image, hasTheSameBytesEachTimeAndReplacesAnOlderFile) {
  const TemporaryDirectory directory;
  savePng(noise(40, 30, 1), directory / "a.png");
  savePng(noise(40, 30, 2), directory / "a.png");
  savePng(noise(40, 30, 2), directory / "b.png");
  EXPECT_EQ(bytesOf(directory / "a.png"), bytesOf(directory / "b.png"));
  const auto files = std::distance(std::filesystem::directory_iterator(directory.path()), {});
  EXPECT_EQ(files, 2) << "a temporary file was left behind";
}

TEST(Image, namesAPathThatCannotBeWritten) {
  const TemporaryDirectory directory;
  const Image image(4, 4, Color{});
  const auto missing = directory / "no" / "such" / "a.png";
  EXPECT_NE(messageOf([&] { savePng(image, missing); }).find(missing.string()), std::string::npos);
  EXPECT_NE(messageOf([&] { savePng(image, directory.path()); }).find(directory.path().string()), std::string::npos);
  EXPECT_NE(messageOf([&] { savePng(Image(), directory / "empty.png"); }).find("empty.png"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST(Image, namesAFileThatIsNoWholePng) {
  const TemporaryDirectory directory;
  savePng(noise(64, 64, 3), directory / "whole.png");
  const std::string whole = bytesOf(directory / "whole.png");
  std::ofstream(directory / "cut.png", std::ios::binary) << whole.substr(0, whole.size() / 2);
  std::ofstream(directory / "foreign.png", std::ios::binary) << "solid nothing\nendsolid\n";
  std::ofstream(directory / "void.png", std::ios::binary);
  for (const char* name : {"cut.png", "foreign.png", "void.png", "missing.png"}) {
    const std::string message = messageOf([&] { loadPng(directory / name); });
    EXPECT_NE(message.find(name), std::string::npos) << name << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
  EXPECT_FALSE(messageOf([&] { loadPng(directory.path()); }).empty());
}

}  // namespace image_test
}  // namespace hpsdf::render
