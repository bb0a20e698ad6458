// Between the plain structs and their Protobuf forms. Only common/wire includes this.
#pragma once

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"
#include "farm.pb.h"
#include "inquiry.pb.h"

namespace pvsfarm {

// One line a message: plain struct, Protobuf message, value of proto::MessageType. The order of
// codec.cpp's dispatch; both directions and the names come from here.
#define PVSFARM_MESSAGES(X)                    \
  X(Hello, Hello, HELLO)                       \
  X(Welcome, Welcome, WELCOME)                 \
  X(Reject, Reject, REJECT)                    \
  X(Task, Task, TASK)                          \
  X(Heartbeat, Heartbeat, HEARTBEAT)           \
  X(HeartbeatAck, HeartbeatAck, HEARTBEAT_ACK) \
  X(ResultBegin, ResultBegin, RESULT_BEGIN)    \
  X(ResultChunk, ResultChunk, RESULT_CHUNK)    \
  X(ResultEnd, ResultEnd, RESULT_END)          \
  X(ResultAck, ResultAck, RESULT_ACK)          \
  X(TaskFailed, TaskFailed, TASK_FAILED)       \
  X(BlobGet, BlobGet, BLOB_GET)                \
  X(BlobChunk, BlobChunk, BLOB_CHUNK)          \
  X(Cancel, Cancel, CANCEL)                    \
  X(Drain, Empty, DRAIN)                       \
  X(Draining, Empty, DRAINING)                 \
  X(Bye, Empty, BYE)                           \
  X(Shutdown, Empty, SHUTDOWN)                 \
  X(StatusGet, Empty, STATUS_GET)              \
  X(StatusReport, StatusReport, STATUS)        \
  X(Control, Control, CONTROL)                 \
  X(ControlAck, Empty, CONTROL_ACK)            \
  X(Inquiry, Inquiry, INQUIRY)                 \
  X(FindingBegin, FindingBegin, FINDING_BEGIN) \
  X(ChunkCredit, ChunkCredit, CHUNK_CREDIT)

#define PVSFARM_DECLARE(Plain, Proto, Type)             \
  void pack(const Plain& plain, proto::Proto& message); \
  Status unpack(const proto::Proto& message, Plain& plain);
PVSFARM_MESSAGES(PVSFARM_DECLARE)
#undef PVSFARM_DECLARE

// Parts of messages that are in several of them.
void pack_key(const CellKey& key, proto::CellKey& out);
void pack_cell(const Cell& cell, proto::Cell& out);
void pack_set(const ParentSet& set, proto::ParentSet& out);
bool unpack_key(const proto::CellKey& in, CellKey& out);
bool unpack_cell(const proto::Cell& in, Cell& out);
bool unpack_set(const proto::ParentSet& in, ParentSet& out);

}  // namespace pvsfarm
