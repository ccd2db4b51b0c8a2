#pragma once
// Access to the JSON of a glTF file that checks what it finds.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace hpsdf::mesh {

/// A value in the JSON of a glTF file, together with its name in the file, such as "accessors[3].sparse". All functions
/// throw `Error` with this name if the value, or the member that is asked for, is not what it must be. The JSON must
/// outlive this object.
class GltfValue {
 public:
  /// Takes the root of the JSON. `file` names the file in errors.
  GltfValue(const nlohmann::json& json, const std::string& file) : json_(&json), file_(&file) {}

  bool has(const char* member) const;
  GltfValue get(const char* member) const;  ///< a member, which must exist

  /// Returns the number of items of an array, or of a member that is an array, 0 if it does not exist.
  std::size_t size() const;
  std::size_t size(const char* member) const;
  GltfValue at(std::size_t index) const;  ///< an item of an array, which must exist

  std::uint64_t whole() const;  ///< a number from 0 to 2^53 without a fraction
  std::uint64_t whole(const char* member) const { return get(member).whole(); }
  std::uint64_t whole(const char* member, std::uint64_t otherwise) const;
  bool flag(const char* member) const;  ///< a member that is true or false; false if it does not exist
  std::string text() const;
  std::string text(const char* member) const { return get(member).text(); }

  /// Returns an array of so many finite numbers.
  std::vector<double> numbers(std::size_t count) const;

  [[noreturn]] void refuse(const std::string& problem) const;

 private:
  GltfValue(const nlohmann::json& json, const GltfValue& parent, std::string name)
      : json_(&json), file_(parent.file_), name_(std::move(name)) {}

  const nlohmann::json* json_;
  const std::string* file_;
  std::string name_;
};

}  // namespace hpsdf::mesh
