#pragma once
// Fields that the processes of an MPI program build together.

#include <memory>

#include "hpsdf/parallel/ranks.h"

namespace hpsdf::mpi {

/// Initializes MPI for the lifetime of this object, with the thread support that `ranksOf` needs. Programs that
/// initialize MPI themselves ask for MPI_THREAD_SERIALIZED or more: the calls are made by one thread at a time, but not
/// always by the same one. Throws `Error` if MPI does not offer this.
class Session {
 public:
  Session();
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
};

/// Returns the processes of a communicator as ranks for `buildByRanks`. `communicator` is the handle that
/// MPI_Comm_c2f returns for it, so that this header need not include that of MPI. The ranks use a duplicate of the
/// communicator: their messages cannot be taken for others. All processes of the communicator must call this function,
/// and must destroy what it returns before MPI ends.
std::unique_ptr<Ranks> ranksOf(int communicator);

/// Returns all processes of the program, those of MPI_COMM_WORLD.
std::unique_ptr<Ranks> allRanks();

}  // namespace hpsdf::mpi
