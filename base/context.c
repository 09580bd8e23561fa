// context.c - memory that is counted, workers with fixed blocks, log, progress, cancelling
// SPDX-License-Identifier: BSD-3-Clause
//
// Every block from vt_alloc carries its size in a 64-byte head, so that the bound of --max-memory is kept, the peak is
// known, and a leak is found when the context goes. vt_parallel hands out fixed blocks of items from a counter: which
// worker takes a block is chance, what a block computes is not.

#include "base/context.h"

#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define MAX_WORKERS 64
#define HEAD_BYTES 64

typedef struct worker {
  vt_context *context;
  int number;
} worker;

struct vt_context {
  vt_context_desc desc;
  int thread_count;
  atomic_uint_least64_t bytes_in_use, peak_bytes;
  volatile sig_atomic_t cancelled;

  pthread_mutex_t error_lock;
  vt_status error_status;
  char error[1024];

  pthread_mutex_t lock; // guards what follows
  pthread_cond_t work_there, work_done;
  pthread_t threads[MAX_WORKERS];
  worker workers[MAX_WORKERS];
  int threads_started, busy;
  uint64_t job; // number of the current job
  bool stop, in_parallel;
  vt_block_function run;
  void *user;
  size_t count, block;
  atomic_size_t next;

  char stage[64], held[64]; // shown; held while others come and go
  double stage_start, last_shown, held_share;
};

vt_context_desc vt_default_context_desc(void) { return (vt_context_desc){.cookie = VT_COOKIE, .log_level = VT_LOG_NORMAL}; }

static void run_blocks(vt_context *context, int number) {
  while (!context->cancelled) {
    size_t begin = atomic_fetch_add(&context->next, 1);
    if (begin >= (context->count + context->block - 1) / context->block) return;
    begin *= context->block;
    size_t end = begin + context->block < context->count ? begin + context->block : context->count;
    context->run(context->user, begin, end, number);
  }
}

static void *work(void *argument) {
  worker *self = argument;
  vt_context *context = self->context;
  uint64_t seen = 0;
  pthread_mutex_lock(&context->lock);
  for (;;) {
    while (!context->stop && context->job == seen) pthread_cond_wait(&context->work_there, &context->lock);
    if (context->stop) break;
    seen = context->job;
    pthread_mutex_unlock(&context->lock);
    run_blocks(context, self->number);
    pthread_mutex_lock(&context->lock);
    if (--context->busy == 0) pthread_cond_signal(&context->work_done);
  }
  pthread_mutex_unlock(&context->lock);
  return NULL;
}

vt_context *vt_create_context(const vt_context_desc *desc) {
  VT_ASSERT(desc && desc->cookie == VT_COOKIE);
  VT_ASSERT(desc->thread_count >= 0 && desc->thread_count <= MAX_WORKERS);
  vt_context *context = calloc(1, sizeof *context);
  if (!context) return NULL;
  context->desc = *desc;
  long processors = sysconf(_SC_NPROCESSORS_ONLN);
  context->thread_count = desc->thread_count ? desc->thread_count : (int)(processors < 1 ? 1 : processors);
  if (context->thread_count > MAX_WORKERS) context->thread_count = MAX_WORKERS;
  pthread_mutex_init(&context->error_lock, NULL);
  pthread_mutex_init(&context->lock, NULL);
  pthread_cond_init(&context->work_there, NULL);
  pthread_cond_init(&context->work_done, NULL);
  for (int i = 1; i < context->thread_count; i++) { // the caller is worker 0
    context->workers[i] = (worker){context, i};
    if (pthread_create(&context->threads[i], NULL, work, &context->workers[i])) {
      vt_destroy_context(context);
      return NULL;
    }
    context->threads_started = i;
  }
  return context;
}

void vt_destroy_context(vt_context *context) {
  if (!context) return;
  pthread_mutex_lock(&context->lock);
  context->stop = true;
  pthread_cond_broadcast(&context->work_there);
  pthread_mutex_unlock(&context->lock);
  for (int i = 1; i <= context->threads_started; i++) pthread_join(context->threads[i], NULL);
  pthread_cond_destroy(&context->work_there);
  pthread_cond_destroy(&context->work_done);
  pthread_mutex_destroy(&context->lock);
  pthread_mutex_destroy(&context->error_lock);
  uint64_t left = context->bytes_in_use;
  free(context);
  VT_ASSERT(left == 0);
}

// ---- errors

vt_status vt_fail(vt_context *context, vt_status status, const char *format, ...) {
  pthread_mutex_lock(&context->error_lock);
  if (!context->error[0]) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(context->error, sizeof context->error, format, arguments);
    va_end(arguments);
    context->error_status = status;
  }
  pthread_mutex_unlock(&context->error_lock);
  return status;
}

const char *vt_last_error(const vt_context *context) { return context->error; }

void vt_clear_error(vt_context *context) {
  pthread_mutex_lock(&context->error_lock);
  context->error[0] = 0;
  context->error_status = VT_OK;
  pthread_mutex_unlock(&context->error_lock);
}

// ---- memory

static bool reserve(vt_context *context, uint64_t bytes) {
  uint64_t now = atomic_fetch_add(&context->bytes_in_use, bytes) + bytes;
  uint64_t bound = context->desc.max_memory;
  if (bound && now > bound) {
    atomic_fetch_sub(&context->bytes_in_use, bytes);
    vt_fail(context, VT_OUT_OF_MEMORY,
            "memory: %.4g MB are wanted and --max-memory is %.4g MB; give more, or a lower --levels, or smaller pictures",
            (double)now / 1e6, (double)bound / 1e6);
    return false;
  }
  uint64_t peak = context->peak_bytes;
  while (now > peak && !atomic_compare_exchange_weak(&context->peak_bytes, &peak, now)) {}
  return true;
}

void *vt_alloc(vt_context *context, size_t count, size_t size) {
  uint64_t bytes = (uint64_t)count * size;
  if (size && (count > (SIZE_MAX / 2) / size || bytes > (SIZE_MAX / 2) - 2 * HEAD_BYTES)) {
    vt_fail(context, VT_OUT_OF_MEMORY, "memory: %zu items of %zu bytes are more than this machine can address; "
            "give a lower --levels, or smaller pictures", count, size);
    return NULL;
  }
  if (!reserve(context, bytes)) return NULL;
  size_t whole = (HEAD_BYTES + (size_t)bytes + HEAD_BYTES - 1) / HEAD_BYTES * HEAD_BYTES;
  void *raw = NULL;
  if (posix_memalign(&raw, HEAD_BYTES, whole)) {
    atomic_fetch_sub(&context->bytes_in_use, bytes);
    vt_fail(context, VT_OUT_OF_MEMORY, "memory: the system has no %.0f MB left; close other programs, or give a lower "
            "--levels, or smaller pictures", (double)bytes / 1e6);
    return NULL;
  }
  memset(raw, 0, whole);
  *(uint64_t *)raw = bytes;
  return (char *)raw + HEAD_BYTES;
}

void *vt_realloc(vt_context *context, void *block, size_t count, size_t size) {
  void *bigger = vt_alloc(context, count, size);
  if (!bigger || !block) return bigger;
  uint64_t old = *(uint64_t *)(void *)((char *)block - HEAD_BYTES), wanted = (uint64_t)count * size;
  memcpy(bigger, block, (size_t)(old < wanted ? old : wanted));
  vt_free(context, block);
  return bigger;
}

void vt_free(vt_context *context, void *block) {
  if (!block) return;
  char *raw = (char *)block - HEAD_BYTES;
  atomic_fetch_sub(&context->bytes_in_use, *(uint64_t *)(void *)raw);
  free(raw);
}

char *vt_strdup(vt_context *context, const char *text) {
  size_t size = strlen(text) + 1;
  char *copy = vt_alloc(context, size, 1);
  if (copy) memcpy(copy, text, size);
  return copy;
}

uint64_t vt_bytes_in_use(const vt_context *context) { return context->bytes_in_use; }
uint64_t vt_peak_bytes(const vt_context *context) { return context->peak_bytes; }
void vt_reset_peak(vt_context *context) { context->peak_bytes = context->bytes_in_use; }
uint64_t vt_max_memory(const vt_context *context) { return context->desc.max_memory; }

uint64_t vt_memory_bound(const vt_context *context) {
  if (context->desc.max_memory) return context->desc.max_memory;
  long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  return pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page / 4 * 3 : UINT64_MAX;
}

// ---- threads

int vt_thread_count(const vt_context *context) { return context->thread_count; }

vt_status vt_parallel(vt_context *context, size_t count, size_t block, vt_block_function run, void *user) {
  VT_ASSERT(block > 0 && run && !context->in_parallel);
  context->in_parallel = true;
  pthread_mutex_lock(&context->lock);
  context->run = run;
  context->user = user;
  context->count = count;
  context->block = block;
  context->next = 0;
  context->busy = context->threads_started;
  context->job++;
  if (context->busy) pthread_cond_broadcast(&context->work_there);
  pthread_mutex_unlock(&context->lock);
  run_blocks(context, 0);
  pthread_mutex_lock(&context->lock);
  while (context->busy) pthread_cond_wait(&context->work_done, &context->lock);
  pthread_mutex_unlock(&context->lock);
  context->in_parallel = false;
  return context->cancelled ? vt_fail(context, VT_CANCELLED, "interrupted: nothing was written; run it again") : VT_OK;
}

// ---- cancel

void vt_cancel(vt_context *context) { context->cancelled = 1; }
bool vt_cancelled(const vt_context *context) { return context->cancelled != 0; }

// ---- log, progress, probes

static void clear_progress(vt_context *context) {
  if (context->desc.show_progress && context->last_shown > 0) fputs("\r\033[K", stderr);
}

void vt_log(vt_context *context, vt_log_level level, const char *format, ...) {
  if (level > context->desc.log_level) return;
  clear_progress(context);
  va_list arguments;
  va_start(arguments, format);
  vfprintf(stderr, format, arguments);
  va_end(arguments);
  fputc('\n', stderr);
}

void vt_hold_progress(vt_context *context, const char *stage) {
  snprintf(context->held, sizeof context->held, "%s", stage ? stage : "");
  context->held_share = 0;
}

void vt_progress(vt_context *context, const char *stage, double share) {
  if (!context->desc.show_progress || context->desc.log_level == VT_LOG_QUIET) return;
  const char *inner = "";
  if (*context->held && strncmp(stage, context->held, sizeof context->held - 1)) {
    inner = stage, stage = context->held, share = context->held_share;
  } else if (*context->held) {
    context->held_share = share;
  }
  double now = vt_seconds();
  if (strncmp(stage, context->stage, sizeof context->stage - 1)) {
    snprintf(context->stage, sizeof context->stage, "%s", stage);
    context->stage_start = now;
    context->last_shown = 0;
  }
  if (share >= 1) {
    clear_progress(context);
    context->last_shown = 0;
    return;
  }
  if (now - context->last_shown < 0.1) return;
  context->last_shown = now;
  int filled = (int)(share * 30);
  char bar[31];
  for (int i = 0; i < 30; i++) bar[i] = i < filled ? '#' : '.';
  bar[30] = 0;
  double left = share > 0.01 ? (now - context->stage_start) * (1 - share) / share : 0;
  fprintf(stderr, "\r\033[K%-14s [%s] %3.0f %%  %.0f s left%s%s", stage, bar, 100 * share, left, *inner ? ", " : "", inner);
  fflush(stderr);
}

bool vt_wants_probes(const vt_context *context) { return context->desc.probe != NULL; }
void vt_probe(vt_context *context, const char *name, const struct vt_fimage *image) {
  if (context->desc.probe) context->desc.probe(context->desc.probe_user, name, image);
}

static double clock_seconds(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
double vt_seconds(void) { return clock_seconds(CLOCK_MONOTONIC); }
double vt_cpu_seconds(void) { return clock_seconds(CLOCK_PROCESS_CPUTIME_ID); }
