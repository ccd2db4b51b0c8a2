#include "mesh/read/gltf_document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/text.h"
#include "mesh/scan/word_text.h"

namespace hpsdf::mesh {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF files are little-endian");

/// Extensions that change the geometry and that this reader knows.
constexpr std::array<std::string_view, 3> kGeometryExtensions = {"KHR_mesh_quantization", kDracoExtension,
                                                                 "EXT_mesh_gpu_instancing"};

/// Beginnings of the names of extensions that leave the geometry as it is: materials, textures, lights, metadata.
constexpr std::array<std::string_view, 11> kHarmlessExtensions = {
    "KHR_materials_",  "KHR_texture_", "KHR_lights_", "KHR_xmp",           "KHR_animation_",
    "KHR_technique",   "EXT_texture_", "EXT_lights_", "EXT_mesh_features", "EXT_structural_metadata",
    "MSFT_texture_dds"};

std::vector<std::byte> readBytes(Input& input, std::uint64_t count) {
  if (count > input.mostLeft())
    input.refuse("it promises " + std::to_string(count) + " bytes, but only " + std::to_string(input.mostLeft()) +
                 " follow; check or export the file again");
  std::vector<std::byte> bytes;
  requireMemory("the file", double(count), "simplify the mesh first");
  bytes.reserve(count);
  while (bytes.size() < count) {
    if (!input.ensure(1)) input.refuse("the file ends too early; check or export it again");
    const std::string_view piece = input.rest().substr(0, count - bytes.size());
    const auto part = std::as_bytes(std::span(piece));
    bytes.insert(bytes.end(), part.begin(), part.end());
    input.skip(piece.size());
  }
  return bytes;
}

/// Reads all that is left of a file, which has the JSON.
std::vector<std::byte> readRest(Input& input) {
  std::vector<std::byte> bytes;
  bytes.reserve(input.mostLeft());
  while (input.ensure(1)) {
    const auto part = std::as_bytes(std::span(input.rest()));
    bytes.insert(bytes.end(), part.begin(), part.end());
    input.skip(part.size());
  }
  return bytes;
}

std::uint32_t word(Input& input) {
  std::uint32_t number = 0;
  if (!input.ensure(sizeof number)) input.refuse("the file ends within a header; check or export it again");
  std::memcpy(&number, input.rest().data(), sizeof number);
  input.skip(sizeof number);
  return number;
}

int valueOfBase64(char c) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::size_t at = kDigits.find(c);
  return at == kDigits.npos ? -1 : int(at);
}

/// Returns the bytes that a base64 text stands for, or std::nullopt if it is not one.
std::optional<std::vector<std::byte>> fromBase64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = valueOfBase64(c);
    if (value < 0) return std::nullopt;
    bits = bits << 6 | std::uint32_t(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(std::byte(bits >> count & 0xff));
  }
  return bytes;
}

/// Returns the text of a URI with its %XX replaced by the bytes that they stand for.
std::string fromPercent(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const std::string_view digits = uri.substr(i).substr(0, 3);
    unsigned value = 0;
    const bool isEscape = digits.size() == 3 && digits[0] == '%' &&
                          std::from_chars(digits.data() + 1, digits.data() + 3, value, 16).ptr == digits.data() + 3;
    text += isEscape ? char(value) : uri[i];
    if (isEscape) i += 2;
  }
  return text;
}

/// The type of an accessor's components.
struct ComponentType {
  std::size_t size = 0;
  double (*read)(const std::byte*) = nullptr;
  double greatest = 1;        ///< the number that stands for 1 if components are normalized
  bool isNormalized = false;  ///< whole numbers stand for fractions

  double at(const std::byte* bytes) const {
    const double number = read(bytes);
    return isNormalized ? std::max(number / greatest, -1.0) : number;
  }
};

template <typename T>
double readAs(const std::byte* bytes) {
  T number;
  std::memcpy(&number, bytes, sizeof number);
  return double(number);
}

ComponentType componentType(const GltfValue& object) {
  const bool isNormalized = object.flag("normalized");
  switch (object.whole("componentType")) {
    case 5120:
      return {1, readAs<std::int8_t>, 127, isNormalized};
    case 5121:
      return {1, readAs<std::uint8_t>, 255, isNormalized};
    case 5122:
      return {2, readAs<std::int16_t>, 32767, isNormalized};
    case 5123:
      return {2, readAs<std::uint16_t>, 65535, isNormalized};
    case 5125:
      return {4, readAs<std::uint32_t>, 4294967295.0, isNormalized};
    case 5126:
      return {4, readAs<float>};
    default:
      object.refuse("has an unknown componentType");
  }
}

/// Throws `Error` if the components are not unsigned whole numbers.
void requireIndexType(const GltfValue& object) {
  const std::uint64_t type = object.whole("componentType");
  if ((type != 5121 && type != 5123 && type != 5125) || object.flag("normalized"))
    object.refuse("has a type of numbers that are no indices");
}

std::size_t componentsOf(const GltfValue& accessor) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kTypes = {
      {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
  const std::string type = accessor.text("type");
  for (const auto& [name, components] : kTypes)
    if (type == name) return components;
  accessor.refuse("has the unknown type '" + wordText(type) + "'");
}

/// Returns the part of a buffer view that an accessor needs: `count` elements of `size` bytes, `stride` bytes apart.
std::span<const std::byte> partOf(const GltfValue& object, std::span<const std::byte> view, std::uint64_t offset,
                                  std::uint64_t count, std::size_t size, std::uint64_t stride) {
  const bool fits =
      offset <= view.size() &&
      (count == 0 || (size <= view.size() - offset && (count - 1) <= (view.size() - offset - size) / stride));
  if (!fits) object.refuse("reaches beyond the end of its buffer view");
  return view.subspan(offset);
}

}  // namespace

GltfDocument::GltfDocument(Input& input) : file_(input.file().string()), progress_(input.progress()) {
  constexpr std::string_view kMagic = "glTF";
  input.ensure(kMagic.size());
  if (input.rest().starts_with(kMagic))
    readGlb(input);
  else
    parse(readRest(input));
  fileBytes_ = input.offset();
  const GltfValue asset = root().get("asset");
  if (!asset.text("version").starts_with("2.")) asset.refuse("has a version other than 2.0, which alone is read");
  requireKnownExtensions();
}

GltfDocument::~GltfDocument() = default;

void GltfDocument::parse(const std::vector<std::byte>& bytes) {
  constexpr double kBytesAByte = 40;  // An empty array of two characters takes about 80 bytes.
  requireMemory("the JSON of a glTF file", kBytesAByte * double(bytes.size()), "simplify the mesh first");
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  namesDraco_ = text.find(kDracoExtension) != text.npos;
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw Error(ErrorKind::file, file_,
                "its JSON cannot be read (byte " + std::to_string(error.byte) + "); check or export it again");
  } catch (const nlohmann::json::out_of_range&) {  // has no position
    throw Error(ErrorKind::file, file_,
                "its JSON has a number beyond the range of doubles; check or export the file again");
  }
  json_ = std::make_unique<const nlohmann::json>(std::move(json));
}

void GltfDocument::readGlb(Input& input) {
  constexpr std::uint32_t kHeader = 12, kJson = 0x4e4f534a, kBinary = 0x004e4942;
  word(input);
  if (const std::uint32_t version = word(input); version != 2)
    input.refuse("a binary glTF file of version " + std::to_string(version) + "; version 2 is read: export it again");
  const std::uint32_t length = word(input);
  if (length < kHeader || length - kHeader > input.mostLeft())
    input.refuse("it promises " + std::to_string(length) + " bytes, but has only " +
                 std::to_string(input.mostLeft() + kHeader) + "; check or export it again");
  for (std::uint32_t chunk = 0; input.offset() + 8 <= length; ++chunk) {
    const std::uint32_t bytes = word(input), type = word(input);
    if (bytes > length - input.offset()) input.refuse("a chunk reaches beyond the file; check or export it again");
    std::vector<std::byte> content = readBytes(input, bytes);
    if (chunk == 0 && type != kJson) input.refuse("its first chunk is no JSON; check or export it again");
    if (type == kJson && chunk == 0) parse(content);
    if (type == kBinary && chunk == 1) binary_ = std::move(content);
  }
  if (!json_) input.refuse("it has no JSON; check or export it again");
  if (input.offset() != length || input.ensure(1))
    input.refuse("the file goes on behind the parts that it promises; check or export it again");
}

GltfValue GltfDocument::root() const { return {*json_, file_}; }

GltfValue GltfDocument::item(const char* array, std::uint64_t index) const { return root().get(array).at(index); }

void GltfDocument::requireKnownExtensions() const {
  if (!root().has("extensionsRequired")) return;
  const GltfValue required = root().get("extensionsRequired");
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = required.at(i).text();
    const auto begins = [&](std::string_view beginning) { return name.starts_with(beginning); };
    if (std::ranges::find(kGeometryExtensions, name) == kGeometryExtensions.end() &&
        std::ranges::none_of(kHarmlessExtensions, begins))
      throw Error(ErrorKind::file, file_,
                  "it requires the glTF extension " + wordText(name) + ", which is not known: export it without");
  }
}

std::vector<std::byte> GltfDocument::bufferFile(const GltfValue& buffer, const std::string& uri,
                                                std::uint64_t bytes) const {
  constexpr std::string_view kBase64 = ";base64,";
  if (lowerCase(uri.substr(0, 5)) == "data:") {
    const std::string data = fromPercent(uri);
    const std::size_t begin = data.find(kBase64);
    auto decoded =
        begin == data.npos ? std::nullopt : fromBase64(std::string_view(data).substr(begin + kBase64.size()));
    if (!decoded) buffer.refuse("has data that are not base64");
    return std::move(*decoded);
  }
  const std::filesystem::path path = fromPercent(uri);
  if (uri.find("://") != uri.npos || path.is_absolute() || std::ranges::find(path, "..") != path.end())
    buffer.refuse("lies elsewhere ('" + wordText(uri) + "'): only files in the folder of the glTF file are read");
  try {
    Input input(std::filesystem::path(file_).parent_path() / path, progress_);
    return readBytes(input, bytes);
  } catch (const Error& error) {
    throw Error(ErrorKind::file, file_, "its buffer '" + wordText(uri) + "': " + error.problem());
  }
}

std::span<const std::byte> GltfDocument::buffer(std::uint64_t index) {
  const GltfValue object = item("buffers", index);
  const std::uint64_t bytes = object.whole("byteLength");
  const bool isBinary = index == 0 && !object.has("uri");
  if (isBinary && binary_.empty()) object.refuse("has no uri, and the file has no binary chunk");
  if (!isBinary && !buffers_.contains(index)) {
    requireMemory("the buffers of a glTF file", double(bufferBytes_) + double(bytes), "simplify the mesh first");
    buffers_[index] = bufferFile(object, object.text("uri"), bytes);
    bufferBytes_ += buffers_[index].size();
  }
  const std::vector<std::byte>& content = isBinary ? binary_ : buffers_.at(index);
  if (bytes > content.size())
    object.refuse("promises " + std::to_string(bytes) + " bytes, but has only " + std::to_string(content.size()));
  return std::span(content).first(bytes);
}

/// Returns the bytes of the file and of all its buffers.
std::uint64_t GltfDocument::allBytes() {
  for (std::size_t index = 0; index < root().size("buffers"); ++index) buffer(index);
  return fileBytes_ + bufferBytes_;
}

std::span<const std::byte> GltfDocument::view(std::uint64_t index) {
  const GltfValue object = item("bufferViews", index);
  const std::span<const std::byte> bytes = buffer(object.whole("buffer"));
  const std::uint64_t offset = object.whole("byteOffset", 0), length = object.whole("byteLength");
  if (offset > bytes.size() || length > bytes.size() - offset) object.refuse("reaches beyond the end of its buffer");
  return bytes.subspan(offset, length);
}

std::vector<double> GltfDocument::numbers(std::uint64_t accessor, std::size_t components) {
  const GltfValue object = item("accessors", accessor);
  if (componentsOf(object) != components) object.refuse("does not have " + std::to_string(components) + " components");
  const std::uint64_t count = object.whole("count");
  const ComponentType type = componentType(object);
  const std::size_t size = type.size * components;
  std::span<const std::byte> bytes;
  std::uint64_t stride = size;
  if (object.has("bufferView")) {
    const GltfValue view = item("bufferViews", object.whole("bufferView"));
    stride = view.whole("byteStride", size);
    if (stride < size) view.refuse("has a byteStride below the size of its elements");
    bytes = partOf(object, this->view(object.whole("bufferView")), object.whole("byteOffset", 0), count, size, stride);
  } else if (count > allBytes()) {
    object.refuse("has no buffer view, and promises more elements than the file and its buffers have bytes");
  }
  requireMemory("the mesh", double(count) * double(components) * sizeof(double), "simplify the mesh first");
  std::vector<double> numbers(count * components);
  for (std::uint64_t i = 0; !bytes.empty() && i < count; ++i)
    for (std::size_t c = 0; c < components; ++c)
      numbers[i * components + c] = type.at(bytes.data() + i * stride + c * type.size);
  if (object.has("sparse")) putSparse(object, components, numbers);
  return numbers;
}

std::vector<double> GltfDocument::indices(std::uint64_t accessor) {
  requireIndexType(item("accessors", accessor));
  return numbers(accessor, 1);
}

/// Replaces the elements of an accessor that its member `sparse` names.
void GltfDocument::putSparse(const GltfValue& accessor, std::size_t components, std::vector<double>& numbers) {
  const GltfValue sparse = accessor.get("sparse"), indices = sparse.get("indices"), values = sparse.get("values");
  const std::uint64_t count = sparse.whole("count");
  requireIndexType(indices);
  const ComponentType indexType = componentType(indices), type = componentType(accessor);
  const std::size_t size = type.size * components;
  const auto where = partOf(indices, view(indices.whole("bufferView")), indices.whole("byteOffset", 0), count,
                            indexType.size, indexType.size);
  const auto what = partOf(values, view(values.whole("bufferView")), values.whole("byteOffset", 0), count, size, size);
  for (std::uint64_t i = 0; i < count; ++i) {
    const double index = indexType.at(where.data() + i * indexType.size);
    if (!(index >= 0 && index < double(numbers.size() / components))) sparse.refuse("has an index out of range");
    for (std::size_t c = 0; c < components; ++c)
      numbers[std::size_t(index) * components + c] = type.at(what.data() + i * size + c * type.size);
  }
}

}  // namespace hpsdf::mesh
