// Queries take no memory: counted by replacing the global operator new of this program.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include "hpsdf/build.h"
#include "hpsdf/continuity.h"
#include "hpsdf/exact_distance.h"
#include "hpsdf/shapes.h"

namespace {

std::atomic<std::size_t> allocations = 0;

}  // namespace

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {  // stable sorts take their buffers here
  ++allocations;
  return std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }

namespace hpsdf {
namespace {

template <typename F>
std::size_t allocationsOf(F&& f) {
  const std::size_t before = allocations;
  f();
  return allocations - before;
}

TEST(Allocations, AreCounted) {
  EXPECT_GT(allocationsOf([] { std::vector<int>(100).at(3) = 1; }), 0u);
}

TEST(Allocations, QueriesMakeNone) {
  const TriangleMesh mesh = shapes::mesh("builtin:torus,segments=32,sides=16");
  const ExactDistance distance(mesh);
  const Field field = build(distance, domainAround(mesh), {.targetError = 1e-5}), smooth = blended(field, 0.2);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5);  // some outside
  std::vector<Vector3> points(1000);
  for (Vector3& x : points) x = {coordinate(random), coordinate(random), coordinate(random)};
  std::vector<double> values(points.size());
  std::vector<ValueAndGradient> both(points.size());
  double sum = 0;
  EXPECT_EQ(allocationsOf([&] {
              for (const Vector3& x : points) {
                sum += field.value(x) + field.valueAndGradient(x).gradient.x() + field.cellAt(x).error + distance(x);
              }
              for (const Vector3& x : points) sum += smooth.value(x) + smooth.valueAndGradient(x).gradient.x();
              for (const Field* f : {&field, &smooth}) {
                f->values(points, values);
                f->valuesAndGradients(points, both);
              }
              distance(points, values);
            }),
            0u);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace hpsdf
