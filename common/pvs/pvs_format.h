/* Numbers of the .pvs file format, for its reader (C) and its writer (C++).
 * docs/store_format.md is the grammar; this file gives the offsets it names. All numbers in a store
 * are little endian; every block is a multiple of 8 bytes long, padded with zeros. */
#ifndef PVS_FORMAT_H
#define PVS_FORMAT_H

#define PVS_FORMAT_VERSION 3u
#define PVS_HEAD_MAGIC "\x89PVS\r\n\x1a\n" /* as PNG's: a transfer as text breaks it */
#define PVS_TAIL_MAGIC "PVS END\n"
#define PVS_NO_PARENT 0xffffffffu
#define PVS_MAX_NODES 0xfffffffeu
#define PVS_MAX_OBJECTS 0x80000000u

/* Blocks, in the order in which they stand in the file; there may be any number of chunks. */
enum {
  PVS_BLOCK_HEADER = 1,
  PVS_BLOCK_OBJECTS = 2,
  PVS_BLOCK_NAMES = 3,
  PVS_BLOCK_CHUNK = 4,
  PVS_BLOCK_SUBTREES = 5,
  PVS_BLOCK_LOCATE = 6
};

enum {                                 /* the header block */
       PVS_HEADER_MAGIC = 0,           /* 8 bytes */
       PVS_HEADER_VERSION = 8,         /* u32 */
       PVS_HEADER_UP = 12,             /* u32: 0 z, 1 y */
       PVS_HEADER_OBJECT_COUNT = 16,   /* u32 */
       PVS_HEADER_SETTINGS_BYTES = 20, /* u32 */
       PVS_HEADER_SCENE_DIGEST = 24,   /* 32 bytes */
       PVS_HEADER_BAKE_DIGEST = 56,    /* 32 bytes */
       PVS_HEADER_SETTINGS = 88        /* JSON text */
};

enum {                             /* an object */
       PVS_OBJECT_BOX = 0,         /* f64[6]: lowest corner, highest corner */
       PVS_OBJECT_NAME_END = 48,   /* u64: in the names; it begins where the one before ends */
       PVS_OBJECT_TRIANGLES = 56,  /* u32 */
       PVS_OBJECT_FILE_INDEX = 60, /* u32 */
       PVS_OBJECT_FLAGS = 64,      /* u32 */
       PVS_OBJECT_BYTES = 72       /* 4 bytes of zero at the end */
};
enum { PVS_FLAG_OCCLUDER = 1, PVS_FLAG_OCCLUDEE = 2, PVS_FLAG_DYNAMIC = 4 };

enum { /* the head of a chunk; leaf bits, columns, frames, coordinates, group ends, groups follow */
       PVS_CHUNK_NODES = 0,        /* u32 */
       PVS_CHUNK_FRAMES = 4,       /* u32 */
       PVS_CHUNK_COORDINATES = 8,  /* u32 */
       PVS_CHUNK_ROW_SETS = 12,    /* u32: 1: visible; 2: visible and seen */
       PVS_CHUNK_GROUP_BYTES = 16, /* u32 */
       PVS_CHUNK_LEAVES = 20,      /* u32 */
       PVS_CHUNK_COLUMNS = 24,     /* a column's head for each field of a node */
       PVS_COLUMN_BASE = 0,        /* u64 */
       PVS_COLUMN_WIDTH = 8,       /* u32: bits a number, 0 to 64 */
       PVS_COLUMN_HEAD_BYTES = 16,
       PVS_NODE_FIELDS = 16,
       PVS_CHUNK_HEAD_BYTES = PVS_CHUNK_COLUMNS + PVS_NODE_FIELDS * PVS_COLUMN_HEAD_BYTES
};

enum {                                  /* the fields of a node or of a leaf: a column each */
       PVS_NODE_BOX = 0,                /* six: numbers of coordinates: lo, then hi */
       PVS_NODE_ROOT_ID = 6,            /* i64 */
       PVS_NODE_PATH = 7,               /* u64 */
       PVS_NODE_ROOT = 8,               /* u32 */
       PVS_NODE_PARENT = 9,             /* u32: so many nodes before; 0: none */
       PVS_NODE_FRAME = 10,             /* u32: 0: axis-aligned; k: frame k - 1 of the chunk */
       PVS_NODE_FLAGS = 11,             /* u32: PVS_FLAG_*, and the reason times PVS_FIELD_REASON */
       PVS_LEAF_FIELDS = 12,            /* from here on of leaves only */
       PVS_NODE_VISIBLE_OBJECTS = 12,   /* u32: the size of its sets */
       PVS_NODE_VISIBLE_TRIANGLES = 13, /* u32 */
       PVS_NODE_SEEN_OBJECTS = 14,      /* u32 */
       PVS_NODE_SEEN_TRIANGLES = 15     /* u32 */
};
enum { PVS_FIELD_REASON = 4 };

enum {                         /* subtrees: a number a node follows */
       PVS_SUBTREES_WIDTH = 0, /* u32: bytes a number, 0 to 4 */
       PVS_SUBTREES_HEAD_BYTES = 8
};

enum { PVS_FLAG_LEAF = 1, PVS_FLAG_QUARANTINED = 2 };
enum { PVS_FRAME_BYTES = 96 }; /* f64[12]: origin, three axes */

enum {                       /* location: roots, boxes of 16 of them, of 256, ... */
       PVS_LOCATE_ROOTS = 0, /* u32 */
       PVS_LOCATE_HEAD_BYTES = 8,
       PVS_LOCATE_FANOUT = 16,
       PVS_LOCATE_MAX_LEVELS = 8, /* 16^8 >= 2^32 */
       PVS_LOCATE_BOX_BYTES = 24  /* f32[6] */
};

enum {                           /* an entry of the directory */
       PVS_ENTRY_KIND = 0,       /* u32 */
       PVS_ENTRY_FIRST_NODE = 4, /* u32; 0 if the block is no chunk */
       PVS_ENTRY_OFFSET = 8,     /* u64 */
       PVS_ENTRY_LENGTH = 16,    /* u64 */
       PVS_ENTRY_CHECKSUM = 24,  /* u64 */
       PVS_ENTRY_BYTES = 32
};

enum {                                  /* the tail */
       PVS_TAIL_DIRECTORY_OFFSET = 0,   /* u64 */
       PVS_TAIL_DIRECTORY_CHECKSUM = 8, /* u64 */
       PVS_TAIL_BLOCKS = 16,            /* u32 */
       PVS_TAIL_NODES = 20,             /* u32 */
       PVS_TAIL_LEAVES = 24,            /* u32 */
       PVS_TAIL_DIGEST = 32,            /* 32 bytes; bytes 28..31 are zero */
       PVS_TAIL_CHECKSUM = 64,          /* u64, of the 64 bytes before it */
       PVS_TAIL_END_MAGIC = 72,         /* 8 bytes */
       PVS_TAIL_BYTES = 80
};

#endif
