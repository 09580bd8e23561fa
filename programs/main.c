// main.c - the program voltree: finds the verb, runs it, and turns its status into a sentence and an exit code
// SPDX-License-Identifier: BSD-3-Clause
#include "programs/verbs.h"

#include <signal.h>
#include <string.h>

static const vt_verb *const verbs[] = {&vt_verb_synth,    &vt_verb_capture, &vt_verb_reconstruct, &vt_verb_compress,
                                       &vt_verb_evaluate, &vt_verb_render,  &vt_verb_play,        &vt_verb_info,
                                       &vt_verb_export,   &vt_verb_bench,   &vt_verb_doctor};
#define VERB_COUNT ((int)(sizeof verbs / sizeof *verbs))

static const vt_verb *find_verb(const char *name) {
  for (int i = 0; i < VERB_COUNT; i++)
    if (!strcmp(verbs[i]->name, name)) return verbs[i];
  return NULL;
}

static void print_overview(FILE *file) {
  fputs("Usage: voltree VERB ...\n"
        "Photographs of a tree in, a compact volumetric tree out.\n\nVerbs:\n",
        file);
  for (int i = 0; i < VERB_COUNT; i++) fprintf(file, "  %-12s %s\n", verbs[i]->name, verbs[i]->summary);
  fputs("\nvoltree VERB --help explains a verb; voltree --version tells the version.\n"
        "\nExample:\n  voltree reconstruct photos/ -o tree.vtree --holdout 8\n"
        "\nExit codes: 0 ok, 1 failed, 2 wrong command line, 3 unusable input, 4 too few photographs registered,\n"
        "5 missing program, 6 over memory, 7 below a requested quality, 130 interrupted.\n",
        file);
}

static int complain_verb(const char *name) {
  const char *names[VERB_COUNT];
  for (int i = 0; i < VERB_COUNT; i++) names[i] = verbs[i]->name;
  const char *nearest = vt_nearest_word(name, names, VERB_COUNT);
  if (nearest)
    fprintf(stderr, "voltree: %s: unknown verb; did you mean %s? (voltree --help lists all)\n", name, nearest);
  else
    fprintf(stderr, "voltree: %s: unknown verb; voltree --help lists all\n", name);
  return VT_BAD_USAGE;
}

// A signal handler can reach nothing but a global: the one of this program. Set while a verb runs.
static vt_context *volatile running;
static void stop(int signal_number) {
  (void)signal_number;
  if (running) vt_cancel(running);
}

static void catch_signals(void) {
  // The second Ctrl-C ends the program at once. Children get the default action back when they are executed.
  struct sigaction action = {.sa_handler = stop, .sa_flags = (int)SA_RESETHAND};
  sigemptyset(&action.sa_mask);
  static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
  for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
    struct sigaction old;
    if (!sigaction(signals[i], NULL, &old) && old.sa_handler != SIG_IGN) sigaction(signals[i], &action, NULL);
  }
  signal(SIGPIPE, SIG_IGN); // a reader that went away is an error of writing, which is reported
}

static int run_verb(const vt_verb *verb, int count, char **words) {
  vt_session session = {0};
  char problem[1100] = "";
  vt_status status = vt_parse_arguments(verb, count, words, &session.arguments);
  if (status) {
    fprintf(stderr, "voltree: %s\n", session.arguments.problem);
    return (int)status;
  }
  if (session.arguments.help) {
    vt_print_help(stdout, verb);
    return VT_OK;
  }
  if (session.arguments.version) {
    puts("voltree " VT_VERSION);
    return VT_OK;
  }
  status = vt_begin_session(&session, problem, sizeof problem);
  if (!status) {
    running = session.context;
    catch_signals();
    status = verb->run(&session);
    running = NULL;
    if (status == VT_CANCELLED || (status && vt_cancelled(session.context))) {
      status = VT_CANCELLED;
      snprintf(problem, sizeof problem, "%s: interrupted; no part of an output was left, run it again", verb->name);
    } else if (status) {
      const char *error = vt_last_error(session.context);
      snprintf(problem, sizeof problem, "%s", *error ? error : "unknown trouble; run it again with --verbose");
    }
  }
  if (!status && (fflush(stdout) || ferror(stdout))) {
    snprintf(problem, sizeof problem, "standard output: cannot be written; look at where it goes");
    status = VT_FAILED;
  }
  if (status && session.context)
    vt_log(session.context, VT_LOG_QUIET, "voltree: %s", problem); // clears a progress bar
  else if (status)
    fprintf(stderr, "voltree: %s\n", problem);
  vt_end_session(&session);
  return (int)status;
}

int main(int count, char **words) {
  if (count < 2) {
    fputs("voltree: no verb was given; give one of these\n", stderr);
    print_overview(stderr);
    return VT_BAD_USAGE;
  }
  const char *name = words[1];
  if (!strcmp(name, "--version")) {
    puts("voltree " VT_VERSION);
    return VT_OK;
  }
  if (!strcmp(name, "--help") || !strcmp(name, "-h") || !strcmp(name, "help")) {
    const vt_verb *verb = count > 2 ? find_verb(words[2]) : NULL;
    if (count > 2 && !verb) return complain_verb(words[2]);
    if (verb)
      vt_print_help(stdout, verb);
    else
      print_overview(stdout);
    return VT_OK;
  }
  if (name[0] == '-') {
    fprintf(stderr, "voltree: %s: the verb comes first; voltree --help lists all\n", name);
    return VT_BAD_USAGE;
  }
  const vt_verb *verb = find_verb(name);
  return verb ? run_verb(verb, count - 2, words + 2) : complain_verb(name);
}
