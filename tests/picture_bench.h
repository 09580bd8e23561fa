// picture_bench.h - a folder for one test, pictures to put there, and files put together byte by byte
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_TESTS_PICTURE_BENCH_H
#define VT_TESTS_PICTURE_BENCH_H

#include "tests/unit.h"

#include "base/file.h"
#include "base/image_file.h"
#include "base/rng.h"
#include <unistd.h>

typedef struct bench { // a context and a folder of its own
  vt_context *context;
  char folder[64], path[128];
} bench;

static inline void open_bench(bench *b, int threads, uint64_t max_memory) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = threads;
  desc.max_memory = max_memory;
  desc.log_level = VT_LOG_QUIET;
  b->context = vt_create_context(&desc);
  assert_non_null(b->context);
  strcpy(b->folder, "/tmp/voltree-images-XXXXXX");
  assert_non_null(mkdtemp(b->folder));
}

static inline void close_bench(bench *b) {
  char command[128];
  snprintf(command, sizeof command, "rm -rf '%s'", b->folder);
  assert_int_equal(system(command), 0);
  vt_destroy_context(b->context); // asserts that nothing is left
}

static inline char *in_folder(bench *b, const char *name) {
  snprintf(b->path, sizeof b->path, "%s/%s", b->folder, name);
  return b->path;
}

static inline vt_image make_noise(bench *b, int width, int height, int channels, bool smooth) {
  vt_image image;
  vt_rng rng = vt_seed_rng((uint64_t)(width * 7 + channels), 1);
  assert_int_equal(vt_make_image(b->context, width, height, channels, &image), VT_OK);
  size_t row = (size_t)(width * channels), size = row * (size_t)height;
  for (size_t i = 0; i < size; i++)
    image.pixels[i] = smooth ? (uint8_t)(i % row / 2 + i / row) : (uint8_t)vt_random(&rng);
  for (size_t i = 0; channels == 4 && i < size; i += 8) image.pixels[i + 3] = 0; // colour without alpha
  return image;
}

static inline void put_file(bench *b, const char *name, const void *bytes,
                            size_t size) { // without waiting for the disk
  FILE *file = fopen(in_folder(b, name), "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(bytes, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

// Reads, and expects these pixels.
static inline void expect_pixels(bench *b, const char *name, int width, int height, int channels,
                                 const uint8_t *pixels) {
  vt_image back;
  vt_status status = vt_read_image(b->context, in_folder(b, name), &back);
  if (status) fail_msg("%s", vt_last_error(b->context));
  assert_int_equal(back.width, width);
  assert_int_equal(back.height, height);
  assert_int_equal(back.channels, channels);
  assert_memory_equal(back.pixels, pixels, (size_t)(width * height * channels));
  vt_free_image(b->context, &back);
}

static inline void expect_refusal(bench *b, const char *name, vt_status expected) {
  vt_image back;
  vt_status status = vt_read_image(b->context, in_folder(b, name), &back);
  if (status != expected) fail_msg("%s: status %d, not %d", name, status, expected);
  assert_non_null(strstr(vt_last_error(b->context), name));
  assert_non_null(strstr(vt_last_error(b->context), "; ")); // the cure
  assert_null(back.pixels);
  vt_clear_error(b->context);
}

typedef struct bytes {
  uint8_t data[8192];
  size_t size;
} bytes;

static inline void put(bytes *o, const void *data, size_t size) {
  assert_true(o->size + size <= sizeof o->data);
  memcpy(o->data + o->size, data, size);
  o->size += size;
}

static inline void put_word(bytes *o, uint64_t value, int size, bool big) {
  for (int i = 0; i < size; i++) {
    uint8_t byte = (uint8_t)(value >> 8 * (big ? size - 1 - i : i));
    put(o, &byte, 1);
  }
}

static inline void put_png_chunk(bytes *o, const char *type, const uint8_t *data, size_t size) {
  put_word(o, size, 4, true);
  size_t begin = o->size;
  put(o, type, 4);
  put(o, data, size);
  uint32_t crc = 0xffffffffu;
  for (size_t i = begin; i < o->size; i++) {
    crc ^= o->data[i];
    for (int k = 0; k < 8; k++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  put_word(o, ~crc, 4, true);
}

// Rows come with their filter bytes.
static inline void make_png(bytes *o, int width, int height, int depth, int colour_type, const uint8_t *rows,
                            size_t size) {
  bytes head = {.size = 0}, data = {.size = 0};
  uint32_t a = 1, c = 0;
  put_word(&head, (uint64_t)width, 4, true);
  put_word(&head, (uint64_t)height, 4, true);
  const uint8_t kind[5] = {(uint8_t)depth, (uint8_t)colour_type, 0, 0, 0};
  put(&head, kind, 5);
  put(&data, "\x78\x01\x01", 3); // zlib, one stored block
  put_word(&data, size, 2, false);
  put_word(&data, ~size & 0xffff, 2, false);
  put(&data, rows, size);
  for (size_t i = 0; i < size; i++) a = (a + rows[i]) % 65521, c = (c + a) % 65521;
  put_word(&data, (uint64_t)c << 16 | a, 4, true);
  o->size = 0;
  put(o, "\x89PNG\r\n\x1a\n", 8);
  put_png_chunk(o, "IHDR", head.data, head.size);
  put_png_chunk(o, "IDAT", data.data, data.size);
  put_png_chunk(o, "IEND", (const uint8_t *)"", 0);
}

#endif
