#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace hpsdf::render {

/// An sRGB colour with 8 bits a channel.
using Color = std::array<std::uint8_t, 3>;

/// sRGB picture, rows top to bottom.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Color> pixels;

  Image() = default;
  Image(int columns, int rows, Color fill) : width(columns), height(rows), pixels(std::size_t(columns) * rows, fill) {}
  Color& at(int x, int y) { return pixels[std::size_t(y) * width + x]; }
  const Color& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
};

/// Throws `hpsdf::Error` naming the file. Written under a temporary name and renamed.
void savePng(const Image& image, const std::filesystem::path& file);
Image loadPng(const std::filesystem::path& file);

/// Of a picture drawn from a view. Throws `Error` for a size or sample count out of range: 16 to 16384 pixels, 1 to 8,
/// no more than 64 Mi samples in all.
void checkPictureSize(int width, int height, int samples);

}  // namespace hpsdf::render
