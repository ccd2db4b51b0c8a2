#include "hpsdf/render/image.h"

#include <algorithm>
#include <cerrno>
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

std::string systemReason() { return errno ? std::strerror(errno) : "unknown reason"; }

}  // namespace

std::string pngBytes(const Image& image) {
  if (image.width <= 0 || image.height <= 0 || image.pixels.size() != std::size_t(image.width) * image.height)
    throw Error("cannot write the picture: it has no pixels; draw one first");
  std::string bytes;
  const auto append = [](void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), std::size_t(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, 3, image.pixels.data(), image.width * 3))
    throw Error("cannot write the picture: not enough memory to compress it; make it smaller");
  return bytes;
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
