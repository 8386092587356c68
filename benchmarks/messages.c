/* What a program sends: counts the messages, collective operations and bytes of MPI calls, and the time spent in them.
 *
 * To be preloaded into the ranks of a program (benchmarks.messages does so). It stands between the program and MPI by
 * MPI's own profiling interface, in C (PETSc, DOLFINx, mpi4py) and in Fortran (MUMPS), so nothing that is sent escapes
 * but what MPI sends on its own behalf, and the collective operations that begin in the background (MPI_Ibarrier, ...).
 * Bytes are those that this rank gives: the size of its message, or of its part of a collective operation.
 */
#include <mpi.h>
#include <stdlib.h>
#include <string.h>

enum kind { SEND, REDUCE, BCAST, GATHER, ALLTOALL, BARRIER, WAIT, KINDS };

static double calls[KINDS], bytes[KINDS], seconds[KINDS];

/* Copies the counts, 3 KINDS numbers: calls, bytes, seconds, each by kind. */
void messages_read(double *found) {
  memcpy(found, calls, sizeof calls);
  memcpy(found + KINDS, bytes, sizeof bytes);
  memcpy(found + 2 * KINDS, seconds, sizeof seconds);
}

static double size_of(MPI_Count count, MPI_Datatype type) {
  int size = 0;
  if (type != MPI_DATATYPE_NULL) PMPI_Type_size(type, &size);
  return (double)count * size;
}

static int entered(enum kind kind, double amount, double start, int result) {
  calls[kind] += 1.0;
  bytes[kind] += amount;
  seconds[kind] += PMPI_Wtime() - start;
  return result;
}

#define COUNTED(kind, amount, call)                                                                                    \
  do {                                                                                                                 \
    const double start = PMPI_Wtime();                                                                                 \
    return entered(kind, amount, start, call);                                                                         \
  } while (0)

/* Persistent messages: their sizes, by request. */
static MPI_Request *prepared;
static double *prepared_size;
static int prepared_count, prepared_room;

static void prepare(MPI_Request request, double size) {
  int place = 0;
  while (place < prepared_count && prepared[place] != request) place++;
  if (place == prepared_room) {
    prepared_room = 2 * prepared_room + 64;
    prepared = realloc(prepared, prepared_room * sizeof *prepared);
    prepared_size = realloc(prepared_size, prepared_room * sizeof *prepared_size);
    if (!prepared || !prepared_size) PMPI_Abort(MPI_COMM_WORLD, 1);
  }
  if (place == prepared_count) prepared_count++;
  prepared[place] = request;
  prepared_size[place] = size;
}

static void count_prepared(MPI_Request request) {
  for (int place = 0; place < prepared_count; place++)
    if (prepared[place] == request) {
      calls[SEND] += prepared_size[place] >= 0.0;
      bytes[SEND] += prepared_size[place] >= 0.0 ? prepared_size[place] : 0.0;
      return;
    }
}

/* With MPI_IN_PLACE types of what is sent are not significant: such calls count without bytes. */
static double given(const void *data, MPI_Count count, MPI_Datatype type) {
  return data == MPI_IN_PLACE ? 0.0 : size_of(count, type);
}

#define COUNT int
#define PLACE int
#define NAMED(call) MPI_##call
#define INNER(call) PMPI_##call
#include "message_calls.h"
#undef COUNT
#undef PLACE
#undef NAMED
#undef INNER

#if MPI_VERSION >= 4 /* mpi4py calls nothing else then */
#define COUNT MPI_Count
#define PLACE MPI_Aint
#define NAMED(call) MPI_##call##_c
#define INNER(call) PMPI_##call##_c
#include "message_calls.h"
#endif

int MPI_Start(MPI_Request *request) {
  count_prepared(*request);
  return PMPI_Start(request);
}

int MPI_Startall(int count, MPI_Request requests[]) {
  for (int i = 0; i < count; i++) count_prepared(requests[i]);
  return PMPI_Startall(count, requests);
}

int MPI_Probe(int from, int tag, MPI_Comm comm, MPI_Status *status) {
  COUNTED(WAIT, 0.0, PMPI_Probe(from, tag, comm, status));
}

int MPI_Wait(MPI_Request *request, MPI_Status *status) { COUNTED(WAIT, 0.0, PMPI_Wait(request, status)); }

int MPI_Waitall(int count, MPI_Request requests[], MPI_Status statuses[]) {
  COUNTED(WAIT, 0.0, PMPI_Waitall(count, requests, statuses));
}

int MPI_Waitany(int count, MPI_Request requests[], int *which, MPI_Status *status) {
  COUNTED(WAIT, 0.0, PMPI_Waitany(count, requests, which, status));
}

int MPI_Barrier(MPI_Comm comm) { COUNTED(BARRIER, 0.0, PMPI_Barrier(comm)); }

/* Fortran: Open MPI's layer calls MPI's inner names, so what MUMPS sends has to be met before. */
#define F_SIZE size_of(*count, PMPI_Type_f2c(*type))
#define F_COUNTED(kind, amount, call)                                                                                  \
  do {                                                                                                                 \
    const double start = PMPI_Wtime();                                                                                 \
    call;                                                                                                              \
    entered(kind, amount, start, 0);                                                                                   \
  } while (0)
#define F_SENDS(name)                                                                                                  \
  void p##name(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);                        \
  void name(void *data, MPI_Fint *count, MPI_Fint *type, MPI_Fint *to, MPI_Fint *tag, MPI_Fint *comm, MPI_Fint *e) {   \
    F_COUNTED(SEND, F_SIZE, p##name(data, count, type, to, tag, comm, e));                                             \
  }
#define F_BEGINS(name)                                                                                                 \
  void p##name(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);            \
  void name(void *data, MPI_Fint *count, MPI_Fint *type, MPI_Fint *to, MPI_Fint *tag, MPI_Fint *comm,                  \
            MPI_Fint *request, MPI_Fint *e) {                                                                          \
    F_COUNTED(SEND, F_SIZE, p##name(data, count, type, to, tag, comm, request, e));                                    \
  }
F_SENDS(mpi_send_)
F_SENDS(mpi_ssend_)
F_SENDS(mpi_bsend_)
F_BEGINS(mpi_isend_)
F_BEGINS(mpi_issend_)

void pmpi_recv_(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_recv_(void *data, MPI_Fint *count, MPI_Fint *type, MPI_Fint *from, MPI_Fint *tag, MPI_Fint *comm,
               MPI_Fint *status, MPI_Fint *e) {
  F_COUNTED(WAIT, 0.0, pmpi_recv_(data, count, type, from, tag, comm, status, e));
}

void pmpi_probe_(MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_probe_(MPI_Fint *from, MPI_Fint *tag, MPI_Fint *comm, MPI_Fint *status, MPI_Fint *e) {
  F_COUNTED(WAIT, 0.0, pmpi_probe_(from, tag, comm, status, e));
}

void pmpi_wait_(MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_wait_(MPI_Fint *request, MPI_Fint *status, MPI_Fint *e) {
  F_COUNTED(WAIT, 0.0, pmpi_wait_(request, status, e));
}

void pmpi_barrier_(MPI_Fint *, MPI_Fint *);
void mpi_barrier_(MPI_Fint *comm, MPI_Fint *e) { F_COUNTED(BARRIER, 0.0, pmpi_barrier_(comm, e)); }

void pmpi_bcast_(void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_bcast_(void *data, MPI_Fint *count, MPI_Fint *type, MPI_Fint *root, MPI_Fint *comm, MPI_Fint *e) {
  F_COUNTED(BCAST, F_SIZE, pmpi_bcast_(data, count, type, root, comm, e));
}

void pmpi_reduce_(void *, void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_reduce_(void *data, void *into, MPI_Fint *count, MPI_Fint *type, MPI_Fint *op, MPI_Fint *root, MPI_Fint *comm,
                 MPI_Fint *e) {
  F_COUNTED(REDUCE, F_SIZE, pmpi_reduce_(data, into, count, type, op, root, comm, e));
}

void pmpi_allreduce_(void *, void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_allreduce_(void *data, void *into, MPI_Fint *count, MPI_Fint *type, MPI_Fint *op, MPI_Fint *comm,
                    MPI_Fint *e) {
  F_COUNTED(REDUCE, F_SIZE, pmpi_allreduce_(data, into, count, type, op, comm, e));
}

void pmpi_gather_(void *, MPI_Fint *, MPI_Fint *, void *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *, MPI_Fint *);
void mpi_gather_(void *data, MPI_Fint *count, MPI_Fint *type, void *into, MPI_Fint *room, MPI_Fint *kind,
                 MPI_Fint *root, MPI_Fint *comm, MPI_Fint *e) {
  F_COUNTED(GATHER, F_SIZE, pmpi_gather_(data, count, type, into, room, kind, root, comm, e));
}
