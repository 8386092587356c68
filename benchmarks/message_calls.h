/* The calls of MPI that have amounts, for messages.c, which includes this file once for each size of counts: for the
 * calls with int and, where MPI has them (from 4.0 on), for those with MPI_Count, whose names end with _c.
 *
 * Defined outside: COUNT and PLACE, the types of counts and displacements; NAMED(call) and INNER(call), the names of a
 * call and of its inner one.
 */
#define BUFFER const void *data, COUNT count, MPI_Datatype type, int to, int tag, MPI_Comm comm
#define SENDS(name)                                                                                                    \
  int NAMED(name)(BUFFER) { COUNTED(SEND, size_of(count, type), INNER(name)(data, count, type, to, tag, comm)); }
#define BEGINS(name)                                                                                                   \
  int NAMED(name)(BUFFER, MPI_Request *request) {                                                                       \
    COUNTED(SEND, size_of(count, type), INNER(name)(data, count, type, to, tag, comm, request));                       \
  }
#define PREPARES(name)                                                                                                 \
  int NAMED(name)(BUFFER, MPI_Request *request) {                                                                       \
    const int result = INNER(name)(data, count, type, to, tag, comm, request);                                         \
    prepare(*request, size_of(count, type));                                                                           \
    return result;                                                                                                     \
  }
SENDS(Send)
SENDS(Ssend)
SENDS(Bsend)
SENDS(Rsend)
BEGINS(Isend)
BEGINS(Issend)
BEGINS(Ibsend)
BEGINS(Irsend)
PREPARES(Send_init)
PREPARES(Ssend_init)
PREPARES(Bsend_init)
PREPARES(Rsend_init)

int NAMED(Recv_init)(void *data, COUNT count, MPI_Datatype type, int from, int tag, MPI_Comm comm, MPI_Request *request) {
  const int result = INNER(Recv_init)(data, count, type, from, tag, comm, request);
  prepare(*request, -1.0); /* a handle may be used again for the other direction */
  return result;
}

int NAMED(Sendrecv)(const void *data, COUNT count, MPI_Datatype type, int to, int tag, void *into, COUNT room,
                 MPI_Datatype kind, int from, int other, MPI_Comm comm, MPI_Status *status) {
  COUNTED(SEND, size_of(count, type),
          INNER(Sendrecv)(data, count, type, to, tag, into, room, kind, from, other, comm, status));
}

int NAMED(Recv)(void *data, COUNT count, MPI_Datatype type, int from, int tag, MPI_Comm comm, MPI_Status *status) {
  COUNTED(WAIT, 0.0, INNER(Recv)(data, count, type, from, tag, comm, status));
}

int NAMED(Bcast)(void *data, COUNT count, MPI_Datatype type, int root, MPI_Comm comm) {
  COUNTED(BCAST, size_of(count, type), INNER(Bcast)(data, count, type, root, comm));
}

int NAMED(Reduce)(const void *data, void *into, COUNT count, MPI_Datatype type, MPI_Op op, int root, MPI_Comm comm) {
  COUNTED(REDUCE, size_of(count, type), INNER(Reduce)(data, into, count, type, op, root, comm));
}

int NAMED(Allreduce)(const void *data, void *into, COUNT count, MPI_Datatype type, MPI_Op op, MPI_Comm comm) {
  COUNTED(REDUCE, size_of(count, type), INNER(Allreduce)(data, into, count, type, op, comm));
}

int NAMED(Scan)(const void *data, void *into, COUNT count, MPI_Datatype type, MPI_Op op, MPI_Comm comm) {
  COUNTED(REDUCE, size_of(count, type), INNER(Scan)(data, into, count, type, op, comm));
}

int NAMED(Exscan)(const void *data, void *into, COUNT count, MPI_Datatype type, MPI_Op op, MPI_Comm comm) {
  COUNTED(REDUCE, size_of(count, type), INNER(Exscan)(data, into, count, type, op, comm));
}

int NAMED(Reduce_scatter_block)(const void *data, void *into, COUNT count, MPI_Datatype type, MPI_Op op, MPI_Comm comm) {
  int size;
  PMPI_Comm_size(comm, &size);
  COUNTED(REDUCE, size * size_of(count, type), INNER(Reduce_scatter_block)(data, into, count, type, op, comm));
}

#define GIVEN const void *data, COUNT count, MPI_Datatype type, void *into
int NAMED(Gather)(GIVEN, COUNT room, MPI_Datatype kind, int root, MPI_Comm comm) {
  COUNTED(GATHER, given(data, count, type), INNER(Gather)(data, count, type, into, room, kind, root, comm));
}

int NAMED(Gatherv)(GIVEN, const COUNT rooms[], const PLACE starts[], MPI_Datatype kind, int root, MPI_Comm comm) {
  COUNTED(GATHER, given(data, count, type), INNER(Gatherv)(data, count, type, into, rooms, starts, kind, root, comm));
}

int NAMED(Allgather)(GIVEN, COUNT room, MPI_Datatype kind, MPI_Comm comm) {
  COUNTED(GATHER, given(data, count, type), INNER(Allgather)(data, count, type, into, room, kind, comm));
}

int NAMED(Allgatherv)(GIVEN, const COUNT rooms[], const PLACE starts[], MPI_Datatype kind, MPI_Comm comm) {
  COUNTED(GATHER, given(data, count, type), INNER(Allgatherv)(data, count, type, into, rooms, starts, kind, comm));
}

int NAMED(Alltoall)(GIVEN, COUNT room, MPI_Datatype kind, MPI_Comm comm) {
  int size;
  PMPI_Comm_size(comm, &size);
  COUNTED(ALLTOALL, size * given(data, count, type), INNER(Alltoall)(data, count, type, into, room, kind, comm));
}

int NAMED(Alltoallv)(const void *data, const COUNT counts[], const PLACE places[], MPI_Datatype type, void *into,
                  const COUNT rooms[], const PLACE starts[], MPI_Datatype kind, MPI_Comm comm) {
  int size;
  COUNT total = 0;
  PMPI_Comm_size(comm, &size);
  if (data != MPI_IN_PLACE)
    for (int i = 0; i < size; i++) total += counts[i];
  COUNTED(ALLTOALL, size_of(total, type),
          INNER(Alltoallv)(data, counts, places, type, into, rooms, starts, kind, comm));
}

int NAMED(Neighbor_alltoall)(GIVEN, COUNT room, MPI_Datatype kind, MPI_Comm comm) {
  COUNTED(ALLTOALL, size_of(count, type), INNER(Neighbor_alltoall)(data, count, type, into, room, kind, comm));
}

int NAMED(Neighbor_alltoallv)(const void *data, const COUNT counts[], const PLACE places[], MPI_Datatype type, void *into,
                           const COUNT rooms[], const PLACE starts[], MPI_Datatype kind, MPI_Comm comm) {
  int from, to, weighted;
  COUNT total = 0;
  PMPI_Dist_graph_neighbors_count(comm, &from, &to, &weighted);
  for (int i = 0; i < to; i++) total += counts[i];
  COUNTED(ALLTOALL, size_of(total, type),
          INNER(Neighbor_alltoallv)(data, counts, places, type, into, rooms, starts, kind, comm));
}

#undef BUFFER
#undef SENDS
#undef BEGINS
#undef PREPARES
#undef GIVEN
