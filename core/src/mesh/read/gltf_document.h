#pragma once
// A glTF file with its buffers and accessors.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/read/gltf_json.h"
#include "mesh/scan/input.h"

namespace hpsdf::mesh {

/// The extension of glTF for meshes that the library Draco has compressed.
constexpr std::string_view kDracoExtension = "KHR_draco_mesh_compression";

/// A glTF 2.0 file, read into memory as JSON, and the buffers that it names: in the file itself (.glb), as base64 text,
/// or in files beside it. Source: Khronos, glTF 2.0 specification (2021).
class GltfDocument {
 public:
  /// Reads the file. Throws `Error` for damaged files, for other versions of glTF, and for required extensions that are
  /// not known. Buffers are read when they are needed first.
  explicit GltfDocument(Input& input);
  ~GltfDocument();

  /// Returns the root of the JSON.
  GltfValue root() const;

  /// Returns an item of one of the arrays in the root, such as "meshes".
  GltfValue item(const char* array, std::uint64_t index) const;

  /// Returns true if the JSON's text has the name of the extension for Draco, without escaped letters.
  bool namesDraco() const { return namesDraco_; }

  /// Returns the bytes of a buffer view, which stay valid as long as this object.
  std::span<const std::byte> view(std::uint64_t index);

  /// Returns the numbers of an accessor, `components` for each of its elements. Whole numbers that are normalized are
  /// turned into fractions. Throws `Error` if its elements have another number of components.
  std::vector<double> numbers(std::uint64_t accessor, std::size_t components);

  /// Returns the numbers of an accessor that holds indices. Throws `Error` if these are not unsigned whole numbers.
  std::vector<double> indices(std::uint64_t accessor);

 private:
  std::span<const std::byte> buffer(std::uint64_t index);
  std::vector<std::byte> bufferFile(const GltfValue& buffer, const std::string& uri, std::uint64_t bytes) const;
  void readGlb(Input& input);
  void parse(const std::vector<std::byte>& bytes);
  void requireKnownExtensions() const;
  std::uint64_t allBytes();
  void putSparse(const GltfValue& accessor, std::size_t components, std::vector<double>& numbers);

  std::string file_;
  const Progress& progress_;
  std::uint64_t fileBytes_ = 0;    ///< length of the file, without the buffers beside it
  std::uint64_t bufferBytes_ = 0;  ///< bytes of all buffers that have been read
  bool namesDraco_ = false;
  std::unique_ptr<const nlohmann::json> json_;
  std::vector<std::byte> binary_;                                 ///< the binary chunk of a .glb file
  std::map<std::uint64_t, std::vector<std::byte>> buffers_ = {};  ///< buffers that are not in the binary chunk
};

}  // namespace hpsdf::mesh
