// test_program_bench.c - voltree bench from outside: its documents, its peers, and that it finds what it is for
// SPDX-License-Identifier: BSD-3-Clause
#if defined(VT_WITH_OPENIMAGEIO) && defined(VT_WITH_JANSSON)
#include "base/context.h"
#include "base/file.h"
#include "base/json.h"
#include "tests/program_run.h"

// One thread, so that processor time is what a run needs; small codebooks, so that reconstructing is most of it.
#define QUICK "bench frontier --quick --threads 1 --repetitions 5 --colour-codewords 32 --alpha-codewords 32 "

static char text[4000000]; // of the file read last
static const char *contents(const char *path) {
  read_text(path, text, sizeof text);
  return text;
}

static int honest; // whether old.json and its folder page/ are there
static void make_honest_report(void) {
  if (honest) return;
  assert_code(run(QUICK "--json old.json --report page"), 0);
  honest = 1;
}

static int count_words(const char *in, const char *word) {
  int count = 0;
  for (const char *at = in; (at = strstr(at, word)); at += strlen(word)) count++;
  return count;
}

// ---- documents

typedef struct document {
  vt_context *context;
  vt_json *root;
} document;
static document open_document(const char *path) {
  vt_context_desc desc = vt_default_context_desc();
  desc.thread_count = 1;
  document d = {.context = vt_create_context(&desc)};
  assert_non_null(d.context);
  assert_int_equal(vt_read_json(d.context, path, &d.root), VT_OK);
  return d;
}
static void close_document(document *d) {
  vt_free_json(d->context, d->root);
  vt_destroy_context(d->context);
}

static void json_names_machine_suite_and_every_table(void **state) {
  (void)state;
  make_honest_report();
  document d = open_document("old.json");
  const vt_json *machine = vt_json_member(d.root, "machine"), *tables = vt_json_member(d.root, "tables");
  assert_string_equal(vt_json_string(vt_json_member(d.root, "suite"), ""), "frontier");
  assert_true(vt_json_bool(vt_json_member(d.root, "quick"), false));
  assert_true(vt_json_number(vt_json_member(machine, "cores"), 0) >= 1);
  assert_true(*vt_json_string(vt_json_member(machine, "processor"), ""));
  assert_true(*vt_json_string(vt_json_member(machine, "simd"), ""));
  assert_true(*vt_json_string(vt_json_member(d.root, "version"), ""));
  assert_int_equal(strlen(vt_json_string(vt_json_member(d.root, "date"), "")), strlen("2026-01-01T00:00:00Z"));
  assert_true(vt_json_count(tables) >= 3);
  for (size_t t = 0; t < vt_json_count(tables); t++) {
    const vt_json *table = vt_json_item(tables, t), *rows = vt_json_member(table, "rows");
    size_t columns = vt_json_count(vt_json_member(table, "columns"));
    assert_true(columns > 0 && vt_json_count(rows) > 0);
    for (size_t r = 0; r < vt_json_count(rows); r++) {
      const vt_json *row = vt_json_item(rows, r);
      assert_int_equal(vt_json_count(vt_json_member(row, "values")), columns);
      for (size_t c = 0; vt_json_member(row, "low") && c < columns; c++) {
        double value = vt_json_number(vt_json_item(vt_json_member(row, "values"), c), 0);
        assert_true(vt_json_number(vt_json_item(vt_json_member(row, "low"), c), 0) <= value);
        assert_true(vt_json_number(vt_json_item(vt_json_member(row, "high"), c), 0) >= value);
      }
    }
  }
  close_document(&d);
}

// The number of a CSV line's fields; -1 where a quote does not close.
static int count_fields(const char *line, size_t length) {
  int fields = 1;
  bool quoted = false;
  for (size_t i = 0; i < length; i++) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] == ',' && !quoted) fields++;
  }
  return quoted ? -1 : fields;
}

static void every_table_is_in_json_csv_and_page(void **state) {
  (void)state;
  make_honest_report();
  document d = open_document("page/report.json");
  const vt_json *tables = vt_json_member(d.root, "tables");
  for (size_t t = 0; t < vt_json_count(tables); t++) {
    const char *name = vt_json_string(vt_json_member(vt_json_item(tables, t), "name"), "");
    char path[200], id[200];
    snprintf(path, sizeof path, "page/%s.csv", name);
    snprintf(id, sizeof id, "<h3 id=\"%s\">", name);
    assert_says(contents("page/index.html"), id);
    const char *csv = contents(path);
    const char *end = strstr(csv, "\r\n");
    assert_non_null(end);
    int fields = count_fields(csv, (size_t)(end - csv)), lines = 0;
    for (; end; csv = end + 2, end = strstr(csv, "\r\n"), lines++) {
      if (count_fields(csv, (size_t)(end - csv)) != fields) printf("%s:%d\n", path, lines + 1);
      assert_int_equal(count_fields(csv, (size_t)(end - csv)), fields);
    }
    assert_int_equal(*csv, 0);
    assert_int_equal(lines, 1 + (int)vt_json_count(vt_json_member(vt_json_item(tables, t), "rows")));
  }
  close_document(&d);
}

static void page_needs_no_network_and_closes_what_it_opens(void **state) {
  (void)state;
  make_honest_report();
  const char *page = contents("page/index.html");
  static const char *const nowhere[] = {"http:", "https:",  "://",   "url(",   "@import",
                                        "href=", "<script", "<link", "<iframe"};
  for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; i++) assert_int_equal(count_words(page, nowhere[i]), 0);
  assert_int_equal(count_words(page, "src=\""),
                   count_words(page, "src=\"data:image/png;base64,iVBOR")); // the signature of PNG
  assert_true(count_words(page, "src=\"") >= 3);
  static const char *const tags[] = {"table", "thead", "tbody", "tr", "figure", "svg",  "text",
                                     "h2",    "h3",    "div",   "ul", "li",     "small"};
  for (size_t i = 0; i < sizeof tags / sizeof *tags; i++) {
    char open[20], open_with[20], close[20];
    snprintf(open, sizeof open, "<%s>", tags[i]);
    snprintf(open_with, sizeof open_with, "<%s ", tags[i]);
    snprintf(close, sizeof close, "</%s>", tags[i]);
    if (count_words(page, open) + count_words(page, open_with) != count_words(page, close)) printf("%s\n", tags[i]);
    assert_int_equal(count_words(page, open) + count_words(page, open_with), count_words(page, close));
  }
  assert_int_equal(count_words(page, "nan"), 0); // of a coordinate
  assert_true(count_words(page, "class=\"point") >= 20);
}

static void names_of_captures_are_text_and_no_markup(void **state) {
  (void)state;
  assert_code(run("synth 'a<b&\"c\",d' --size 48 --views 10 --test-views 2 --leaves 200 -q"), 0);
  assert_code(run(QUICK "--capture 'a<b&\"c\",d' --repetitions 1 --json odd.json --report odd"), 0);
  const char *page = contents("odd/index.html");
  assert_says(page, "a&lt;b&amp;&quot;c&quot;,d");
  assert_int_equal(count_words(page, "a<b"), 0);
  document d = open_document("odd.json");
  close_document(&d);
}

// ---- comparing

static void equal_reports_have_nothing_worse(void **state) {
  (void)state;
  make_honest_report();
  assert_code(run(QUICK "--json again.json"), 0);
  outcome *o = run("bench --compare old.json again.json");
  if (o->code) printf("%s", o->out);
  assert_code(o, 0);
  assert_says(o->out, "0 worse, ");
  assert_says(o->out, ", 0 missing");
  assert_int_equal(count_words(o->out, "worse  "), 0);
  assert_code(run("bench old.json old.json --compare"), 0);
}

static void a_broken_solver_is_found(void **state) {
  (void)state;
  make_honest_report();
  assert_code(run(QUICK "--repetitions 1 --json solver.json --sabotage solver"), 0);
  outcome *o = run("bench --compare old.json solver.json");
  assert_code(o, 7);
  assert_says(o->out, "worse    tree_96: voltree/draft, PSNR");
  assert_says(o->out, "worse    tree_96: voltree/draft, alpha RMSE");
  assert_says(o->err, "got worse than in old.json");
}

static void a_blurred_tree_is_found(void **state) {
  (void)state;
  make_honest_report();
  assert_code(run(QUICK "--repetitions 1 --json blur.json --sabotage blur"), 0);
  outcome *o = run("bench --compare old.json blur.json");
  assert_code(o, 7);
  assert_says(o->out, "worse    tree_96: voltree/draft, sharpness");
}

static void a_slowed_stage_is_found(void **state) {
  (void)state;
  make_honest_report();
  assert_code(run(QUICK "--json slow.json --sabotage slow"), 0);
  outcome *o = run("bench --compare old.json slow.json");
  assert_code(o, 7);
  assert_says(o->out, "slower   tree_96_stages: voltree/draft, reconstruct: ");
  assert_int_equal(count_words(o->out, "worse    tree_96: voltree/draft"), 0); // as good as before
  o = run("bench --compare slow.json old.json");
  assert_code(o, 0);
  assert_says(o->out, "faster   tree_96_stages: voltree/draft, reconstruct: ");
}

static void missing_rows_are_named(void **state) {
  (void)state;
  make_honest_report();
  shell("sed 's!octree 2006/draft!octree 2007/draft!' old.json > renamed.json");
  outcome *o = run("bench --compare old.json renamed.json");
  assert_code(o, 0);
  assert_says(o->out, "missing  tree_96: octree 2006/draft\n");
  assert_says(o->out, "missing  tree_96_stages: octree 2006/draft\n");
}

static void what_cannot_be_compared_is_refused(void **state) {
  (void)state;
  make_honest_report();
  shell("sed 's/\"suite\": \"frontier\"/\"suite\": \"paper\"/' old.json > paper.json");
  shell("sed 's/\"quick\": true/\"quick\": false/' old.json > full.json");
  shell("sed 's/\"processor\": \"[^\"]*\"/\"processor\": \"abacus\"/' old.json > other.json");
  write_words("list.json", "[1, 2]");
  static const struct {
    const char *words, *says;
    int code;
  } cases[] = {{"old.json paper.json", "give two reports of one suite", 3},
               {"old.json full.json", "make both alike", 3},
               {"old.json list.json", "list.json: is no report of voltree bench", 3},
               {"old.json none.json", "none.json", 3},
               {"old.json", "give OLD.json and NEW.json", 2},
               {"old.json old.json old.json", "one name too many", 2}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char words[200];
    snprintf(words, sizeof words, "bench --compare %s", cases[i].words);
    outcome *o = run(words);
    assert_code(o, cases[i].code);
    assert_says(o->err, cases[i].says);
  }
  outcome *o = run("bench --compare old.json other.json");
  assert_code(o, 0);
  assert_says(o->out, "times cannot be compared");
}

// ---- peers

static void write_script(const char *path, const char *lines) {
  char script[2000];
  snprintf(script, sizeof script, "#!/bin/sh\ncapture=$1 seconds=$2 out=$3\n%s\n", lines);
  write_words(path, script);
  assert_int_equal(chmod(path, 0755), 0);
}

static void peers_are_measured_and_their_faults_told(void **state) {
  (void)state;
  make_honest_report();
  const char *each =
      "for f in $(sed -n 's/.*\"file_path\": *\"\\([^\"]*\\)\".*/\\1/p' $capture/transforms_test.json); do "
      "cp $capture/%s $out/${f##*/}.png; done";
  char lines[600];
  snprintf(lines, sizeof lines, each, "$f.png"); // cheats: the truth itself
  write_script("truth.sh", lines);
  snprintf(lines, sizeof lines, each, "images/train_000.png");
  write_script("first.sh", lines);
  write_script("fails.sh", "echo out of splats; exit 3");
  write_script("silent.sh", "exit 0");
  assert_code(run("synth small --size 40 --views 4 --test-views 1 --leaves 100 -q"), 0);
  char size[400];
  snprintf(size, sizeof size, "cp %s/small/images/test/r_0.png $out/test_000.png", run_folder);
  write_script("size.sh", size);
  outcome *o =
      run(QUICK "--repetitions 1 --peer-seconds 2 --json peers.json --peer truth=./truth.sh --peer first=./first.sh "
                "--peer fails=./fails.sh --peer silent=./silent.sh --peer size=./size.sh --peer nobody=./nobody.sh");
  assert_code(o, 0);
  assert_says(o->out, "tree_96: fails: failed with exit code 3; it last said: out of splats");
  assert_says(o->out, "tree_96: silent: wrote no picture of the 4 test views");
  assert_says(o->out, "tree_96: size: test_000.png: is 40 x 40, and the view 96 x 96");
  assert_says(o->out, "tree_96: nobody: ./nobody.sh: there is no such program");
  o = run("bench --compare old.json peers.json"); // our own rows are what they are without peers
  assert_int_equal(count_words(o->out, "worse    tree_96: voltree/"), 0); // budgets buy what the machine has left
  document d = open_document("peers.json");
  const vt_json *rows = vt_json_member(vt_json_item(vt_json_member(d.root, "tables"), 0), "rows");
  double psnr[2] = {0};
  for (size_t r = 0; r < vt_json_count(rows); r++) {
    const char *label = vt_json_string(vt_json_member(vt_json_item(rows, r), "label"), "");
    double value =
        vt_json_number(vt_json_item(vt_json_member(vt_json_item(rows, r), "values"), 2), -1); // behind the two times
    if (!strcmp(label, "truth/2 s")) psnr[0] = value;
    if (!strcmp(label, "first/2 s")) psnr[1] = value;
    if (!strcmp(label, "fails/2 s")) assert_close(value, -1, 0);
  }
  close_document(&d);
  assert_close(psnr[0], 99, 0);
  assert_in_range((int)psnr[1], 5, 25);
}

static void opaque_pictures_are_judged_over_the_peers_background(void **state) {
  (void)state;
  // A program of OpenSplat's form: looks whether its project is complete and draws the photograph that it must not have
  // seen.
  write_words("splat.py", "import json, os, shutil, sys, time\n"
                          "a = sys.argv[1:]\n"
                          "project, steps = a[0], int(a[a.index('-n') + 1])\n"
                          "image, out = a[a.index('--val-image') + 1], a[a.index('--val-render') + 1]\n"
                          "data = json.load(open(project + '/transforms.json'))\n"
                          "assert open(project + '/' + data['ply_file_path']).read().startswith('ply\\nformat ascii "
                          "1.0\\nelement vertex')\n"
                          "assert all(os.path.exists(project + '/' + f['file_path']) for f in data['frames'])\n"
                          "for step in range(1, steps + 1):\n"
                          "    time.sleep(0.01)\n"
                          "    print('Step %d: 0.1 (1%%)' % step, flush=True)\n"
                          "    if step % 10 == 0: shutil.copy(project + '/images/' + image, out + '/%d.png' % step)\n");
  write_words("splat.sh", "#!/bin/sh\nexec python3 \"$PWD/splat.py\" \"$@\"\n");
  chmod("splat.sh", 0755);
  if (system("command -v python3 >/dev/null && { command -v oiiotool || command -v convert; } >/dev/null")) skip();
  setenv("OPENSPLAT", "./splat.sh", 1);
  setenv("VOLTREE", VT_PROGRAM, 1);
  setenv("VOLTREE_PEERS", "splat=" VT_SOURCE_DIR "/bench/peers/opensplat.sh,", 1);
  outcome *o = run(QUICK "--repetitions 1 --peer-seconds 12 --json splat.json");
  unsetenv("VOLTREE_PEERS");
  assert_code(o, 0);
  assert_says(o->out,
              "tree_96 beside splat at 12 s: the 1 of 4 views that it drew, over its background 0.613 0.0101 0.3984");
  document d = open_document("splat.json");
  const vt_json *tables = vt_json_member(d.root, "tables");
  // the last table but that of the solvers of opacity
  const vt_json *row = vt_json_item(vt_json_member(vt_json_item(tables, vt_json_count(tables) - 2), "rows"), 0);
  assert_string_equal(vt_json_string(vt_json_member(row, "label"), ""), "splat/12 s");
  assert_true(vt_json_number(vt_json_item(vt_json_member(row, "values"), 1), 0) >
              45); // only rounding of the flattened picture
  close_document(&d);
}

static void peers_of_a_wrong_form_are_refused(void **state) {
  (void)state;
  assert_says(run("bench frontier --quick --peer sh")->err, "NAME=EXECUTABLE");
  outcome *o = run("bench frontier --quick --peer a=sh --peer a=sh");
  assert_code(o, 2);
  assert_says(o->err, "already");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(json_names_machine_suite_and_every_table),
      cmocka_unit_test(every_table_is_in_json_csv_and_page),
      cmocka_unit_test(page_needs_no_network_and_closes_what_it_opens),
      cmocka_unit_test(names_of_captures_are_text_and_no_markup),
      cmocka_unit_test(equal_reports_have_nothing_worse),
      cmocka_unit_test(a_broken_solver_is_found),
      cmocka_unit_test(a_blurred_tree_is_found),
      cmocka_unit_test(a_slowed_stage_is_found),
      cmocka_unit_test(missing_rows_are_named),
      cmocka_unit_test(what_cannot_be_compared_is_refused),
      cmocka_unit_test(peers_are_measured_and_their_faults_told),
      cmocka_unit_test(opaque_pictures_are_judged_over_the_peers_background),
      cmocka_unit_test(peers_of_a_wrong_form_are_refused),
  };
  if (enter_folder()) return 1;
  int failed = cmocka_run_group_tests(tests, NULL, NULL);
  leave_folder();
  return failed;
}
#else
int main(void) {
  return 77;
} // nothing to measure pictures of
#endif
