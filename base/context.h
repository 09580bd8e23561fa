// context.h - memory, threads, log, progress, cancelling and probes of one run
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_BASE_CONTEXT_H
#define VT_BASE_CONTEXT_H

#include "base/status.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vt_context vt_context;
struct vt_fimage;

typedef enum vt_log_level { VT_LOG_QUIET, VT_LOG_NORMAL, VT_LOG_VERBOSE } vt_log_level;

#define VT_COOKIE 0x76747265u // stands in every desc; a desc that no vt_default_... made is a caller's bug

typedef struct vt_context_desc {
  uint32_t cookie;
  int thread_count;       // workers, 1..64; 0: as many as the machine has
  uint64_t max_memory;    // bytes that vt_alloc may hand out at one time; 0: no bound
  vt_log_level log_level; // what vt_log and vt_progress say on stderr
  bool show_progress;     // a progress line on stderr (the caller says whether that is a terminal)
  void (*probe)(void *user, const char *name, const struct vt_fimage *image); // or NULL; see vt_probe
  void *probe_user;
} vt_context_desc;

vt_context_desc vt_default_context_desc(void);

// Makes a context and starts its workers. NULL if the system has no memory or threads.
vt_context *vt_create_context(const vt_context_desc *desc);
// Stops the workers. Asserts that everything from vt_alloc was given back. NULL is allowed.
void vt_destroy_context(vt_context *context);

// ---- errors
// Keeps the sentence ("what: why, and what to do", no final newline) and returns `status`. Thread-safe; first one wins
// until vt_clear_error.
#ifdef __GNUC__
__attribute__((format(printf, 3, 4)))
#endif
vt_status vt_fail(vt_context *context, vt_status status, const char *format, ...);
const char *vt_last_error(const vt_context *context); // "" if none; valid until the next vt_fail or vt_clear_error
void vt_clear_error(vt_context *context);

// ---- memory
// count * size bytes, zeroed, aligned to 64. NULL (and vt_fail VT_OUT_OF_MEMORY naming the bound) if over max_memory,
// on overflow, or when the system has none. count 0 gives a valid pointer. Free with vt_free. Thread-safe.
void *vt_alloc(vt_context *context, size_t count, size_t size);
// Grows or shrinks a block from vt_alloc (NULL: a new one), keeps its bytes and zeroes what is new.
// NULL on failure, the old block then stays valid.
void *vt_realloc(vt_context *context, void *block, size_t count, size_t size);
void vt_free(vt_context *context, void *block);
char *vt_strdup(vt_context *context, const char *text); // free with vt_free
uint64_t vt_bytes_in_use(const vt_context *context);
uint64_t vt_peak_bytes(const vt_context *context); // highest since creation or vt_reset_peak
void vt_reset_peak(vt_context *context);
uint64_t vt_max_memory(const vt_context *context); // 0: no bound
uint64_t vt_memory_bound(const vt_context *context); // max_memory, or three quarters of the machine's where it is 0
#define VT_NEW(context, type, count) ((type *)vt_alloc((context), (count), sizeof(type)))

// ---- threads
int vt_thread_count(const vt_context *context);
// Calls run(user, begin, end, worker) for the blocks [0,block), [block,2*block), ... of [0,count) on all workers, in any
// order, worker in [0, vt_thread_count). Blocks are the same for any number of threads: write per item or per block,
// sum block results in block order afterwards, and the result is the same bits. VT_CANCELLED if the run was cancelled
// (some blocks then never ran). Not to be nested.
typedef void (*vt_block_function)(void *user, size_t begin, size_t end, int worker);
vt_status vt_parallel(vt_context *context, size_t count, size_t block, vt_block_function run, void *user);

// ---- cancel
void vt_cancel(vt_context *context); // async-signal-safe
bool vt_cancelled(const vt_context *context);

// ---- log, progress, probes
#ifdef __GNUC__
__attribute__((format(printf, 3, 4)))
#endif
void vt_log(vt_context *context, vt_log_level level, const char *format, ...); // one line, newline added
// Progress of the named stage, share 0..1. Shows a bar with the time left where show_progress.
void vt_progress(vt_context *context, const char *stage, double share);
// While a stage is held, the bar and the time left are its own, and other stages are only named behind it. NULL: none is.
void vt_hold_progress(vt_context *context, const char *stage_or_null);
// Hands a picture of an inner state (a trimap, a hull, a residual) to context.probe if there is one; name is a file name
// without ending. Copies nothing, so build the picture only if vt_wants_probes.
bool vt_wants_probes(const vt_context *context);
void vt_probe(vt_context *context, const char *name, const struct vt_fimage *image);

double vt_seconds(void);     // wall clock, monotonic, from an arbitrary start
double vt_cpu_seconds(void); // processor time of the whole process

#ifdef __cplusplus
}
#endif
#endif
