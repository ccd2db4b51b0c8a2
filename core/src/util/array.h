#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace hpsdf::detail {

/// An array without initial values. Each thread touches memory first where it fills it, so that pages are placed near
/// that thread and no single thread has to clear them beforehand.
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

}  // namespace hpsdf::detail
