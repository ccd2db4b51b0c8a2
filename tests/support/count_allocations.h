#pragma once
// Counts what a program takes by the global operator new, which is replaced: for one source file of each program.

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace hpsdf::support {

inline std::atomic<std::size_t> allocations = 0;

/// So many while f runs, by all threads.
template <typename F>
std::size_t allocationsOf(F&& f) {
  const std::size_t before = allocations;
  f();
  return allocations - before;
}

}  // namespace hpsdf::support

void* operator new(std::size_t size) {
  ++hpsdf::support::allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // stable sorts take their buffers here
  ++hpsdf::support::allocations;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
// GCC takes the free of an inlined delete for a mismatch.
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
