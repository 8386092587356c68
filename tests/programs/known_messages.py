"""Messages and collective operations of known size on two ranks; reports what was counted."""

from __future__ import annotations

import json

import numpy as np
from mpi4py import MPI

from benchmarks.messages import so_far

comm, data, into = MPI.COMM_WORLD, np.ones(10), np.zeros(10)
other = 1 - comm.rank
before = so_far()
for _ in range(3):  # 3 messages of 80 B
    comm.Sendrecv(data, other, recvbuf=into, source=other)
request = comm.Isend(data[:5], other)  # 40 B
comm.Recv(into, other)
request.Wait()
sent, got = comm.Send_init(data, other), comm.Recv_init(into, other)
for _ in range(4):  # 4 of 80 B, prepared once
    MPI.Prequest.Startall([got, sent])
    MPI.Request.Waitall([got, sent])
sent.Free()
got.Free()
comm.Reduce(data, into)
comm.Bcast(into)
comm.Allreduce(data[:1], into[:1])
comm.Allgather(data, np.zeros(20))
comm.Barrier()
found = so_far().minus(before)
words = comm.gather((found.calls, found.bytes, found.seconds))
if comm.rank == 0:
    print(json.dumps(words))
