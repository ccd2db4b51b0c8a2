#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace hpsdf::detail {

/// An array of fixed size that owns its elements, or that lies in memory of another owner, such as a file that is
/// mapped into memory.
template <typename T>
class SharedArray {
 public:
  SharedArray() = default;
  /// Makes an array with uninitialised elements. The threads that fill it are the first to touch its memory pages. The
  /// operating system therefore places each page in the memory closest to its thread. The array is not cleared first.
  explicit SharedArray(std::size_t size) : elements_(std::make_unique_for_overwrite<T[]>(size)), size_(size) {}
  explicit SharedArray(std::vector<T> elements) : size_(elements.size()) {
    auto owner = std::make_shared<std::vector<T>>(std::move(elements));
    elements_ = std::shared_ptr<T[]>(owner, owner->data());
  }
  /// Refers to elements that live as long as `owner`. If they are read-only, they must not be changed.
  SharedArray(const std::shared_ptr<const void>& owner, const T* first, std::size_t size)
      : elements_(std::const_pointer_cast<void>(owner), const_cast<T*>(first)), size_(size) {}

  SharedArray(SharedArray&& other) noexcept
      : elements_(std::move(other.elements_)), size_(std::exchange(other.size_, 0)) {}
  SharedArray& operator=(SharedArray&& other) noexcept {
    elements_ = std::move(other.elements_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return elements_[std::ptrdiff_t(i)]; }
  const T& operator[](std::size_t i) const { return elements_[std::ptrdiff_t(i)]; }
  operator std::span<T>() { return {elements_.get(), size_}; }
  operator std::span<const T>() const { return {elements_.get(), size_}; }

 private:
  std::shared_ptr<T[]> elements_;
  std::size_t size_ = 0;
};

}  // namespace hpsdf::detail
