#include "ranks/process_group.h"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>

namespace hpsdf::app {

bool isStartedTogether() {
  // Set by the mpirun of OpenMPI, and by those of MPICH and its relatives.
  return std::ranges::any_of(std::initializer_list<const char*>{"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"},
                             [](const char* name) {
                               const char* const size = std::getenv(name);
                               return size != nullptr && std::atoi(size) > 1;
                             });
}

}  // namespace hpsdf::app
