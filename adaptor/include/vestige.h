/* SPDX-License-Identifier: BSD-3-Clause */
/*
 * Vestige: proxies of a running simulation's fields (docs/for-simulation-developers.md).
 * This is the only header that a solver needs; C99 and C++.
 *
 * Conventions
 *  1. Every function that can fail returns a vestige_code as an int, VESTIGE_OK = 0. Nothing
 *     throws, exits, aborts, or raises a signal or a floating-point trap. The simulation goes on
 *     whatever is returned; checking is for reporting. Where neither a log is given nor
 *     VESTIGE_QUIET is set, a session writes its first error, the warnings of vestige_open and
 *     vestige_report, and what a dry run finds to the standard error stream, a line each; nothing
 *     else is ever printed.
 *  2. An error of one step (disk full, a bad field) loses that step only; the next one is
 *     tried again. What cannot heal (no OpenGL, a bad configuration, an archive that we may
 *     not touch) disables the session: every later call returns that code at no cost.
 *  3. A session is made by vestige_open, even when it fails, and freed by vestige_close. A
 *     NULL session is a disabled one: vestige_wants is 0, the rest returns
 *     VESTIGE_ERROR_ARGUMENT.
 *  4. Strings, structs and coordinates are copied during the call. Field and mask memory is
 *     SHARED, never copied: it must stay valid and unchanged until the next vestige_execute
 *     returns (then it is forgotten, whatever the result), until it is shared again under its
 *     name, or until vestige_close.
 *  5. Strings we return are ours: valid until the next call on that session, never NULL.
 *  6. One thread at a time per session; any thread. Different sessions are independent. Work
 *     is done by threads of ours: the caller's floating-point environment, locale, signal
 *     handlers, affinity and current GL context are neither used nor changed.
 *  7. Structs begin with their size: use VESTIGE_..._INIT, so that fields can be appended for
 *     ever.
 *  8. Axes are x, y, z. Strides are in bytes and may be negative. NaN, infinity and masked
 *     samples are "no data": transparent, counted and reported.
 *  9. Environment: VESTIGE_DISABLE=1 turns every session into nothing (vestige_open succeeds,
 *     vestige_wants is 0); VESTIGE_RECORD=directory dumps every publish for vestige-replay;
 *     VESTIGE_GL=osmesa|egl chooses the OpenGL implementation.
 */
#ifndef VESTIGE_H
#define VESTIGE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define VESTIGE_API
#else
#define VESTIGE_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* One code per reason. Values are part of the ABI: they are never changed, only added to. */
typedef enum vestige_code {
  VESTIGE_OK = 0,
  VESTIGE_ERROR_ARGUMENT = 1,  /* an argument is out of its stated range */
  VESTIGE_ERROR_CONFIG = 2,    /* the configuration does not parse or make sense */
  VESTIGE_ERROR_NO_GL = 3,     /* no OpenGL implementation could be opened */
  VESTIGE_ERROR_GL = 4,        /* OpenGL failed, e.g. the block is larger than a texture can be */
  VESTIGE_ERROR_IO = 5,        /* a file could not be read or written */
  VESTIGE_ERROR_NO_SPACE = 6,  /* the disk, a quota or a file-size limit is full */
  VESTIGE_ERROR_FORMAT = 7,    /* the archive to append to is damaged */
  VESTIGE_ERROR_EXISTS = 8,    /* the archive exists and [output] existing = "refuse" */
  VESTIGE_ERROR_NOT_FOUND = 9, /* the configuration file does not exist */
  VESTIGE_ERROR_INTERNAL = 10, /* a fault of ours: please report it */
  VESTIGE_ERROR_MEMORY = 11,   /* out of memory */
  VESTIGE_ERROR_MPI = 12,      /* a communicator was given to a build without MPI */
  VESTIGE_ERROR_VERSION = 13,  /* a struct is of a newer or unknown version of this header */
  VESTIGE_ERROR_GRID = 14,     /* blocks overlap, coordinates do not increase, nothing to show */
  VESTIGE_ERROR_NO_BLOCK = 15, /* a block was named that vestige_block has not described */
  VESTIGE_ERROR_NO_FIELD = 16, /* a field to be stored is missing in a block */
  VESTIGE_ERROR_FIELD = 17,    /* a field differs between blocks, or lacks the component */
  VESTIGE_ERROR_CYCLE = 18     /* the cycle is not after the last stored one, or time is NaN */
} vestige_code;

typedef enum vestige_type {
  VESTIGE_FLOAT32 = 0,
  VESTIGE_FLOAT64 = 1,
  VESTIGE_INT8 = 2,
  VESTIGE_UINT8 = 3,
  VESTIGE_INT16 = 4,
  VESTIGE_UINT16 = 5,
  VESTIGE_INT32 = 6,
  VESTIGE_UINT32 = 7,
  VESTIGE_INT64 = 8,
  VESTIGE_UINT64 = 9
} vestige_type;

typedef enum vestige_location {
  VESTIGE_POINT = 0, /* points[a] values along each axis */
  VESTIGE_CELL = 1   /* points[a] - 1 values, at the cells' centres; 1 where points[a] is 1 */
} vestige_location;

typedef enum vestige_level {
  VESTIGE_INFO = 0,
  VESTIGE_WARNING = 1,
  VESTIGE_ERROR = 2
} vestige_level;

typedef enum vestige_flags {
  VESTIGE_QUIET = 1 /* without a log: not even the first error is printed */
} vestige_flags;

typedef struct vestige_session vestige_session;

/* Receives one sentence, without a line end, on the thread that called us and before the call
 * returns. It must not call back into the session. */
typedef void (*vestige_log_callback)(int level, const char* sentence, void* user_data);

#define VESTIGE_NO_MPI (-2147483647 - 1)

typedef struct vestige_options {
  size_t size;              /* sizeof(vestige_options) */
  const char* config;       /* path of a TOML file, or NULL */
  const char* config_text;  /* the TOML itself, or NULL; with neither, the defaults hold */
  const char* output;       /* the archive, instead of [output] path ("vestige.cdb"), or NULL */
  int mpi_comm;             /* Fortran handle, MPI_Comm_c2f(comm); VESTIGE_NO_MPI = one process */
  int flags;                /* 0, or vestige_flags */
  vestige_log_callback log; /* or NULL: convention 1 */
  void* log_data;           /* handed to `log` */
} vestige_options;

#define VESTIGE_OPTIONS_INIT \
  { sizeof(vestige_options), NULL, NULL, NULL, VESTIGE_NO_MPI, 0, NULL, NULL }

/*
 * A block: a box of grid points with its axes along the world's. Along axis a, point i stands at
 *   origin[a] + (first[a] + i) * spacing[a], or at axes[a][i] where axes[a] is not NULL.
 * The block answers for the box between its first and last own (non-ghost) points; these boxes must
 * not overlap and should tile the domain, so neighbours share the points of their common face.
 * (Where a solver's points have one owner each, count the first ghost layer of an upper face as
 * own.) Ghost layers supply the values past a face: with one layer all around (two for gradient
 * magnitudes) splitting a domain into blocks changes nothing.
 */
typedef struct vestige_grid {
  size_t size;           /* sizeof(vestige_grid) */
  int points[3];         /* points (cells + 1) along each axis, ghosts included; any 0: empty */
  int first[3];          /* where the block's point 0 stands in the domain's numbering */
  double origin[3];      /* world position of the domain's point 0 */
  double spacing[3];     /* world, > 0 */
  const double* axes[3]; /* coordinates, strictly increasing, or NULL: uniform along this axis */
  int ghosts[6];         /* ghost layers at -x, +x, -y, +y, -z, +z */
} vestige_grid;

#define VESTIGE_GRID_INIT                                                         \
  {                                                                               \
    sizeof(vestige_grid), {0, 0, 0}, {0, 0, 0}, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, \
        {NULL, NULL, NULL}, {                                                     \
      0, 0, 0, 0, 0, 0                                                            \
    }                                                                             \
  }

/* Opens a session. `options` may be NULL: defaults, no log, archive vestige.cdb. Creates the
 * archive and the OpenGL device. *session is set even on failure (to a disabled session, which
 * knows vestige_last_error and wants to be closed), or to NULL when there is no memory for that. */
VESTIGE_API int vestige_open(const vestige_options* options, vestige_session** session);

/* The whole domain in world units: {x, y, z} of its lowest and highest corner. Optional: without it
 * the domain is the bounding box of the blocks. Holds until called again. */
VESTIGE_API int vestige_domain(vestige_session* session, const double low[3], const double high[3]);

/* 1 if the step may be stored, 0 if not: no trigger fires, or [budget] time_share has no room.
 * Costs nanoseconds; ask before preparing anything. */
VESTIGE_API int vestige_wants(vestige_session* session, int64_t cycle, double time);

/* 1 if the configuration stores something made of the field that is published by this name (and for
 * every name while VESTIGE_RECORD is set), 0 if not: fields that are not wanted need not be
 * gathered or shared. Does not change while the session is open. */
VESTIGE_API int vestige_wants_field(vestige_session* session, const char* name);

/* Describes block `block` (0, 1, ... of this process). Holds until described again; fields that
 * were shared for the block are forgotten. */
VESTIGE_API int vestige_block(vestige_session* session, int block, const vestige_grid* grid);

/* Shares a field of a block (convention 4). `data` is the first sample, ghosts included. `strides`
 * = bytes from one sample to the next along x, y, z, and from one component to the next; NULL = x
 * fastest, then y, z, components side by side. 1 <= components <= 64. */
VESTIGE_API int vestige_share_field(vestige_session* session, int block, const char* name,
                                    int type /* vestige_type */,
                                    int location /* vestige_location */, int components,
                                    const void* data, const ptrdiff_t strides[4]);

/* The same for components in arrays of their own. `strides` = bytes along x, y, z; NULL = packed.
 */
VESTIGE_API int vestige_share_components(vestige_session* session, int block, const char* name,
                                         int type, int location, int components,
                                         const void* const* data, const ptrdiff_t strides[3]);

/* Shares a mask for the block's fields of that location: a sample where (mask & bits) is not 0 is
 * no data. NULL removes it. */
VESTIGE_API int vestige_share_mask(vestige_session* session, int block, int location,
                                   const uint8_t* mask, uint8_t bits, const ptrdiff_t strides[3]);

/* The units of a field, e.g. "K". Holds for the session; the configuration goes before it. */
VESTIGE_API int vestige_units(vestige_session* session, const char* name, const char* units);

/* Stores the step if a trigger of the configuration fires (the first one always is stored). When
 * this returns VESTIGE_OK the step is on disk or was not wanted. Cycles increase. */
VESTIGE_API int vestige_execute(vestige_session* session, int64_t cycle, double time);

/* For what stands between a solver and us, such as an import of another library's data: logs the
 * sentence as an error of the session if `code` is one, else as a warning, once a session. Returns
 * `code`. */
VESTIGE_API int vestige_report(vestige_session* session, int code, const char* sentence);

/* Steps stored so far by this session. */
VESTIGE_API int64_t vestige_stored_steps(const vestige_session* session);

/* Frees the session; NULL is allowed. Returns the code that disabled it, or that of the last
 * vestige_execute if that failed, so that a run which stored nothing ends with an error. */
VESTIGE_API int vestige_close(vestige_session* session);

/* The sentence of the session's last error, "" if there was none. With NULL: of the calling
 * thread's last call without a session. */
VESTIGE_API const char* vestige_last_error(const vestige_session* session);

/* "VESTIGE_OK", "VESTIGE_ERROR_IO" ...; "unknown code" for any other value. Static. */
VESTIGE_API const char* vestige_code_name(int code);

/* "0.1.0". Static. */
VESTIGE_API const char* vestige_version(void);

#ifdef __cplusplus
}
#endif

#endif
