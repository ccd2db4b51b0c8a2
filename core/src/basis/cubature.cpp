#include "basis/cubature.h"

#include <algorithm>
#include <array>
#include <set>
#include <span>

namespace hpsdf::basis {
namespace {

/// A quadrature point that represents all its images under the symmetries of the cube. All images have the same
/// weight.
struct Orbit {
  double weight;
  double x, y, z;
};

// The rules below were found by solving the moment equations with the Levenberg-Marquardt method from random starts,
// for all combinations of orbit types, such as (x, 0, 0) and (x, x, x). Up to order 11 they have as few points as the
// rules in F. Witherden, P. Vincent, "On the identification of symmetric quadrature rules for finite element methods",
// 2015. The tests check the moments of the rules.
constexpr Orbit kOrder5[] = {
    {0.88642659279778391, 0.79582242575422146, 0, 0},
    {0.33518005540166201, 0.75878691063932813, 0.75878691063932813, 0.75878691063932813},
};
constexpr Orbit kOrder7[] = {
    {0.25905804720768905, 0.94648549333311482, 0, 0},
    {0.44222408824962106, 0.41106344257557637, 0.41106344257557637, 0.41106344257557637},
    {0.19159468639884161, 0.75291792012568592, 0.75291792012568592, 0.75291792012568592},
    {0.11459179329718037, 0.89591563784643757, 0.89591563784643757, 0},
};
constexpr Orbit kOrder9[] = {
    {0.43327499574965456, 0.61368146959170899, 0, 0},
    {0.19885983814402353, 0.56411080702003003, 0.56411080702003003, 0.56411080702003003},
    {0.050148795299349035, 0.87009978466197591, 0.87009978466197591, 0.87009978466197591},
    {0.09178980613617764, 0.87768712325767828, 0.87768712325767828, 0},
    {0.096116803513373372, 0.43226790263086212, 0.43226790263086212, 0.93853042186467173},
};
constexpr Orbit kOrder11[] = {
    {0.23693539619216453, 0.72213303887441849, 0, 0},
    {0.062009470300184576, 0.8094882019630989, 0.8094882019630989, 0.8094882019630989},
    {0.17776806487240385, 0.53365400888049708, 0.53365400888049708, 0.53365400888049708},
    {0.13590961715641603, 0.28077258665127441, 0.28077258665127441, 0.28077258665127441},
    {0.12821825421548477, 0.80393346721528447, 0.80393346721528447, 0},
    {0.012950569520258587, 0.98009949100907146, 0.98009949100907146, 0.53078383119382644},
    {0.071810736880956433, 0.40568598019509633, 0.40568598019509633, 0.9545832189295661},
};
constexpr Orbit kOrder13[] = {
    {0.15063366553822993, 0.41808910296911261, 0, 0},
    {0.028698606071616301, 0.99348898061389235, 0, 0},
    {0.020742403134045701, 0.89372539423507846, 0.89372539423507846, 0.89372539423507846},
    {0.070829806763530609, 0.67141064619206547, 0.67141064619206547, 0.67141064619206547},
    {0.10982417038713273, 0.31253085867896996, 0.31253085867896996, 0.66534393179454865},
    {0.0084710944072979716, 0.97066864750138926, 0.97066864750138926, 0.33744196399702647},
    {0.043533455123935839, 0.83675879835614742, 0.83675879835614742, 0.30516670710045024},
    {0.022752966716089677, 0.62304374476702051, 0.62304374476702051, 0.98874940925006705},
    {0.073394508830556732, 0.51568880711009202, 0.90212575093967917, 0},
};

struct Table {
  int order;
  std::span<const Orbit> orbits;
};
constexpr Table kTables[] = {{5, kOrder5}, {7, kOrder7}, {9, kOrder9}, {11, kOrder11}, {13, kOrder13}};

void addImages(const Orbit& orbit, Cubature& rule) {
  std::set<std::array<double, 3>> images;
  std::array<double, 3> point{orbit.x, orbit.y, orbit.z};
  std::ranges::sort(point);
  do {
    for (int signs = 0; signs < 8; ++signs) {
      std::array<double, 3> image;  // Adding 0 turns -0 into 0.
      for (int axis = 0; axis < 3; ++axis) image[axis] = ((signs >> axis & 1) ? -point[axis] : point[axis]) + 0.0;
      images.insert(image);
    }
  } while (std::ranges::next_permutation(point).found);
  for (const auto& [x, y, z] : images) {
    rule.points.emplace_back(x, y, z);
    rule.weights.push_back(orbit.weight);
  }
}

}  // namespace

std::optional<Cubature> compactCubature(int order) {
  const auto table = std::ranges::find_if(kTables, [&](const Table& t) { return t.order >= order; });
  if (table == std::end(kTables)) return std::nullopt;
  Cubature all;
  for (const Orbit& orbit : table->orbits) addImages(orbit, all);
  return all;
}

}  // namespace hpsdf::basis
