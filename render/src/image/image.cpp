#include "hpsdf/render/image.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>

#include "hpsdf/detail/output_file.h"
#include "hpsdf/error.h"

// Makes stb's functions static, so that the library can be linked to an application with its own copy of stb.
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#include <stb/stb_image.h>
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

namespace hpsdf::render {
namespace {

static_assert(sizeof(Color) == 3, "rows of Color are handed to stb as packed bytes");

constexpr int kSmallestSize = 16;
constexpr int kLargestSize = 16384;
constexpr int kMostSamples = 8;
// Greatest number of samples of a picture, to limit its memory. Each sample of a surface takes 27 bytes in the buffers,
// and 27 more while it is rendered. Bodies add 28 bytes per sample, and 12 more while they are drawn.
constexpr std::size_t kMostSamplesInAll = std::size_t{1} << 26;

/// Returns the CRC of a chunk of a PNG file (ISO 3309, polynomial 0xedb88320).
std::uint32_t crcOf(std::string_view bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

std::string bigEndian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(number >> shift));
  return bytes;
}

/// Returns the chunk of a PNG file that holds the number of pixels to a metre.
std::string physicalSizeChunk(double dpi) {
  const std::string perMetre = bigEndian(static_cast<std::uint32_t>(std::lround(dpi / 0.0254)));
  const std::string content = "pHYs" + perMetre + perMetre + '\1';
  return bigEndian(9) + content + bigEndian(crcOf(content));
}

std::string systemReason() { return errno ? std::strerror(errno) : "unknown reason"; }

}  // namespace

std::string pngBytes(const Image& image) {
  if (image.width <= 0 || image.height <= 0 || image.pixels.size() != std::size_t(image.width) * image.height)
    throw Error("cannot write the picture: it has no pixels; draw one first");
  std::vector<std::uint8_t> withAlpha;
  for (std::size_t i = 0; i < image.alpha.size(); ++i) {
    withAlpha.insert(withAlpha.end(), image.pixels[i].begin(), image.pixels[i].end());
    withAlpha.push_back(image.alpha[i]);
  }
  const int channels = withAlpha.empty() ? 3 : 4;
  const void* pixels = withAlpha.empty() ? static_cast<const void*>(image.pixels.data()) : withAlpha.data();
  std::string bytes;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), std::size_t(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, channels, pixels, image.width * channels))
    throw Error("cannot write the picture: not enough memory to compress it; make it smaller");
  constexpr std::size_t kHeader = 33;  // bytes of the signature and of the first chunk, which must be IHDR
  return bytes.insert(kHeader, physicalSizeChunk(image.dpi));
}

void savePng(const Image& image, const std::filesystem::path& file) {
  std::string bytes;
  try {
    bytes = pngBytes(image);
  } catch (const Error& error) {
    throw Error(error.kind(), file.string(), error.what());
  }
  OutputFile output(file);
  output.write(bytes);
  output.commit();
}

Image loadPng(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw Error(file.string() + ": cannot read the picture: it is a directory; name a PNG file");
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(file.string() + ": cannot read the picture: " + systemReason() + "; check the path");
  const std::vector<char> bytes(std::istreambuf_iterator<char>(stream), {});

  int width = 0, height = 0, channels = 0;
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_memory(data, static_cast<int>(bytes.size()), &width, &height, &channels, 3), stbi_image_free);
  if (!pixels)
    throw Error(file.string() + ": cannot read the picture: " + stbi_failure_reason() +
                "; it must be a whole PNG file");
  Image image(width, height, Color{});
  std::memcpy(image.pixels.data(), pixels.get(), image.pixels.size() * sizeof(Color));
  return image;
}

Image withoutBackground(const Image& onWhite, const Image& onBlack) {
  Image image = onWhite;
  image.alpha.resize(image.pixels.size());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    // The two pictures differ by what shines through. The channel that differs most decides, lest a colour be cut off.
    int transparency = 0;
    for (std::size_t k = 0; k < 3; ++k)
      transparency = std::max(transparency, int(onWhite.pixels[i][k]) - int(onBlack.pixels[i][k]));
    const int alpha = 255 - transparency;
    image.alpha[i] = static_cast<std::uint8_t>(alpha);
    for (std::uint8_t& channel : image.pixels[i])
      channel = alpha == 0 ? 0 : static_cast<std::uint8_t>(std::clamp((channel - transparency) * 255 / alpha, 0, 255));
  }
  return image;
}

void checkPictureSize(int width, int height, int samples) {
  const auto size = [&] { return std::to_string(width) + "x" + std::to_string(height); };
  if (std::min(width, height) < kSmallestSize || std::max(width, height) > kLargestSize)
    throw Error("picture size " + size() + " is out of range: give 16 to 16384 pixels a side");
  if (samples < 1 || samples > kMostSamples)
    throw Error("samples = " + std::to_string(samples) + " is out of range: give 1 to 8 samples an axis and pixel");
  if (std::size_t(width) * height * samples * samples > kMostSamplesInAll)
    throw Error("a picture of " + size() + " with " + std::to_string(samples) + "x" + std::to_string(samples) +
                " samples a pixel takes more than 64 million samples: give a smaller size or fewer samples");
}

}  // namespace hpsdf::render
