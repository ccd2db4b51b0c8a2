#pragma once
// Pictures in memory and as PNG files.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace hpsdf::render {

/// An sRGB colour with 8 bits per channel.
using Color = std::array<std::uint8_t, 3>;

/// A colour in linear sRGB, each channel 0 to 1.
using LinearColor = Eigen::Vector3f;

/// Pixels of a screen to an inch, as browsers count them.
constexpr double kScreenDpi = 96;

/// sRGB picture, rows top to bottom.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Color> pixels;
  std::vector<std::uint8_t> alpha = {};  ///< opacity of each pixel, 0 to 255; empty for an opaque picture
  double dpi = kScreenDpi;               ///< pixels to an inch, for PNG files

  Image() = default;
  Image(int columns, int rows, Color fill) : width(columns), height(rows), pixels(std::size_t(columns) * rows, fill) {}
  Color& at(int x, int y) { return pixels[std::size_t(y) * width + x]; }
  const Color& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
};

/// Returns the picture as the bytes of a PNG file, with its physical size. Throws `hpsdf::Error` for a picture without
/// pixels, and if there is not enough memory.
std::string pngBytes(const Image& image);

/// Writes the picture to a temporary file and then renames this file to `file`. If that fails, throws
/// `hpsdf::Error`, which names the file.
void savePng(const Image& image, const std::filesystem::path& file);

/// Loads a picture from a PNG file. Throws `hpsdf::Error`, which names the file.
Image loadPng(const std::filesystem::path& file);

/// Returns the picture whose background is transparent, from the same picture on a white and on a black background.
/// Laid over white, it looks as the first of them.
Image withoutBackground(const Image& onWhite, const Image& onBlack);

/// Throws `Error` unless the size and sample count of a picture are in range: 16 to 16384 pixels per side,
/// 1 to 8 samples per pixel along each axis, and at most 64 Mi samples in all.
void checkPictureSize(int width, int height, int samples);

}  // namespace hpsdf::render
