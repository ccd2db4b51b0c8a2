#include "mesh/read/gltf_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "hpsdf/error.h"

namespace hpsdf::mesh {

bool GltfValue::has(const char* member) const { return json_->is_object() && json_->contains(member); }

GltfValue GltfValue::get(const char* member) const {
  if (!has(member)) refuse("has no member '" + std::string(member) + "'");
  return {(*json_)[member], *this, name_.empty() ? member : name_ + "." + member};
}

std::size_t GltfValue::size() const {
  if (!json_->is_array()) refuse("is not an array");
  return json_->size();
}

std::size_t GltfValue::size(const char* member) const { return has(member) ? get(member).size() : 0; }

GltfValue GltfValue::at(std::size_t index) const {
  if (index >= size()) refuse("has no item " + std::to_string(index));
  return {(*json_)[index], *this, name_ + "[" + std::to_string(index) + "]"};
}

std::uint64_t GltfValue::whole() const {
  constexpr double kMost = 0x1p53;
  const double number = json_->is_number() ? json_->get<double>() : -1;
  if (!(number >= 0 && number <= kMost) || std::floor(number) != number) refuse("is not a whole number from 0");
  return std::uint64_t(number);
}

std::uint64_t GltfValue::whole(const char* member, std::uint64_t otherwise) const {
  return has(member) ? whole(member) : otherwise;
}

bool GltfValue::flag(const char* member) const {
  if (!has(member)) return false;
  const GltfValue value = get(member);
  if (!value.json_->is_boolean()) value.refuse("is neither true nor false");
  return value.json_->get<bool>();
}

std::string GltfValue::text() const {
  if (!json_->is_string()) refuse("is not a text");
  return json_->get<std::string>();
}

std::vector<double> GltfValue::numbers(std::size_t count) const {
  if (size() != count) refuse("does not have " + std::to_string(count) + " numbers");
  std::vector<double> values;
  for (const nlohmann::json& item : *json_) {
    values.push_back(item.is_number() ? item.get<double>() : std::nan(""));
    if (!std::isfinite(values.back())) refuse("holds something that is not a finite number");
  }
  return values;
}

void GltfValue::refuse(const std::string& problem) const {
  const std::string subject = name_.empty() ? "its JSON" : name_;
  throw Error(ErrorKind::file, *file_, subject + " " + problem + "; check or export the file again");
}

}  // namespace hpsdf::mesh
