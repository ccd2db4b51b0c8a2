#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace hpsdf::distance {

/// Elements without initial values: their memory is touched first where they are filled, by many threads, and not
/// before by one.
template <typename T>
class Array {
 public:
  Array() = default;
  explicit Array(std::size_t size) : elements_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}

  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return elements_[i]; }
  const T& operator[](std::size_t i) const { return elements_[i]; }
  operator std::span<const T>() const { return {elements_.get(), size_}; }

 private:
  std::unique_ptr<T[]> elements_;
  std::size_t size_ = 0;
};

}  // namespace hpsdf::distance
