/* The step of a condensed scene: modes, half planes, Kelvin-Voigt and Hunt-Crossley, the midpoint rule.

   One block of doubles holds sizes, data, parameters, state and work; kernel_data.py writes it up to the work. The step
   is that of step_kernel.py, touch_kernel.py and force_solve.py, to round-off: its source and tests are there. */

#ifndef SOURCE
#define SOURCE "unknown"
#endif
#define TINY 1e-300
#define EPS 2e-16
#define TOLERANCE 1e-12
enum { PASSES = 120, PLAIN = 8, RAMP = 60, BISECTIONS = 30 };
enum { MARK, TOTAL, MODES, CONTACTS, LOADS, WATCHED, GROUPS, FULL, STEP, BEGIN, COUNT, OUT, OWN, VALUES, END, HEAD };
enum { GROUP, KIND, BASE, PER, SIDE, SHARE, DAMP, COLUMNS };              /* of a contact */
enum { MEAN, AMPLITUDE, FREQUENCY, PHASE, RISE, VALUE, SLOPE, NUMBERS };  /* of a load; the phase in turns */
#define API __attribute__((visibility("default")))

const char source_mark[] __attribute__((used, visibility("default"))) = "source " SOURCE;

typedef struct {
  int n, m, loads, watched, groups, full, closed;
  double h, *a, *weight, *squares, *inverse, *rows, *patterns, *watch, *contact, *own, *group, *q, *v, *y, *F, *out;
  double *drive, *speed, *D, *free, *y1, *law, *J, *next, *way, *base, *A, *scale, *list, *flag;
} Scene;

static double size(double x) { return x < 0 ? -x : x; }
static double larger(double x, double y) { return x > y ? x : y; }

static Scene opened(double *a) {
  Scene s;
  double *at = a + HEAD;
  int n = s.n = (int)a[MODES], m = s.m = (int)a[CONTACTS];
  s.loads = (int)a[LOADS], s.watched = (int)a[WATCHED], s.groups = (int)a[GROUPS], s.full = (int)a[FULL];
  s.closed = 0, s.h = a[STEP], s.a = a;
#define TAKE(name, count) s.name = at, at += (count)
  TAKE(weight, n); TAKE(squares, n); TAKE(inverse, s.full * n * n); TAKE(rows, m * n); TAKE(patterns, s.loads * n);
  TAKE(watch, s.watched * n); TAKE(contact, m * COLUMNS); TAKE(own, s.loads * NUMBERS); TAKE(group, s.groups * 2);
  TAKE(q, n); TAKE(v, n); TAKE(y, m); TAKE(F, m); TAKE(out, 2 * s.watched + s.groups);
  TAKE(drive, n); TAKE(speed, n); TAKE(D, m * m); TAKE(free, m); TAKE(y1, m); TAKE(law, m); TAKE(J, m); TAKE(next, m);
  TAKE(way, m); TAKE(base, m); TAKE(A, m * m); TAKE(scale, m); TAKE(list, m); TAKE(flag, m);
  return s;
}

/* speeds of the modes under forces on them: x -> A^-1 x, in place of `to` */
static void answered(const Scene *s, const double *x, double *to) {
  for (int i = 0; i < s->n; i++) {
    if (!s->full) to[i] = s->weight[i] * x[i];
    else {
      to[i] = 0;
      for (int j = 0; j < s->n; j++) to[i] += s->inverse[i * s->n + j] * x[j];
    }
  }
}

static double product(const double *x, const double *y, int n) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += x[i] * y[i];
  return sum;
}

static void set_up(const Scene *s) {
  for (int j = 0; j < s->m; j++) {
    answered(s, s->rows + j * s->n, s->speed);
    for (int i = 0; i < s->m; i++) s->D[j * s->m + i] = product(s->rows + i * s->n, s->speed, s->n);
  }
  s->a[MARK] = 2;
}

static double sine(double turns) { /* of 2 pi turns */
  double whole = (double)(long long)turns, x = turns - whole, sum = 0;
  x = x > 0.5 ? x - 1 : x < -0.5 ? x + 1 : x;
  x = x > 0.25 ? 0.5 - x : x < -0.25 ? -0.5 - x : x;
  x *= 6.283185307179586;
  for (int k = 25; k > 0; k -= 2) sum = 1 - sum * x * x / ((k + 1) * (k + 2));
  return x * sum;
}

static double load(const double *l, double t, double since) {
  double r = l[RISE] > 0 && t < l[RISE] ? larger(t, 0) / l[RISE] : 1;
  r = r * r * r * (10 - 15 * r + 6 * r * r);
  return l[MEAN] + r * l[AMPLITUDE] * sine(l[FREQUENCY] * t + l[PHASE]) + l[VALUE] + l[SLOPE] * since;
}

/* mean of the spring over a step between penetrations p and r, and its slope by r */
static void mean(int kind, double stiffness, double p, double r, double *M, double *slope) {
  if (!kind) {
    *M = 0.5 * stiffness * (p + r), *slope = 0.5 * stiffness;
    return;
  }
  double a = __builtin_sqrt(p), b = __builtin_sqrt(r), total = 1, turn = kind - 2, c = 1;
  double scale = stiffness / (0.5 * kind), inverse = 1 / (a + b + TINY);
  for (int i = kind - 2; i >= 0; i--) {
    c *= a;
    total = total * b + c;
    if (i) turn = turn * b + 2 * i * c;
  }
  *M = scale * total * inverse, *slope = 0.5 * scale * turn * inverse * inverse;
}

static void touch(const Scene *s, int j, double factor) {
  const double *c = s->contact + j * COLUMNS, *g = s->group + 2 * (int)c[GROUP];
  double wall = c[BASE] + c[PER] * g[0], x0 = s->y[j] - wall, x1 = s->y1[j] - wall, M, slope;
  s->law[j] = s->J[j] = 0;
  if (x0 <= 0 && x1 <= 0) return;
  double step = s->y1[j] - s->y[j], a = larger(x0, 0), b = larger(x1, 0), inside = x1 > 0, rate = step / s->h;
  double inverse = 1 / (size(step) + TINY), share = x0 > 0 && x1 > 0 ? inside : size(b - a) * inverse;
  double turn = (inside - share) * (step > 0 ? inverse : -inverse);
  mean((int)c[KIND], g[1] * c[SHARE], a, b, &M, &slope);
  double force = share * M;
  slope = turn * M + share * inside * slope;
  double lost = c[KIND] ? c[DAMP] * force * rate : c[DAMP] * share * rate;
  double bend = c[KIND] ? c[DAMP] * (slope * rate + force / s->h) : c[DAMP] * (turn * rate + share / s->h);
  if (c[DAMP] != 0 && !(force + lost > 0)) return;
  s->law[j] = -factor * (force + lost), s->J[j] = -factor * (slope + bend);
}

/* touches of the contacts with a flag; those that begin to feel something are flagged, and their number returned */
static int ask(Scene *s, int which, double factor) {
  int fresh = 0;
  for (int j = 0; j < s->m; j++) {
    if (s->flag[j] != which) continue;
    touch(s, j, factor);
    if (!which && !(size(s->law[j]) + size(s->J[j]) + size(s->F[j]) == 0)) s->flag[j] = 1, fresh++;
  }
  if (fresh) {
    s->closed = 0;
    for (int j = 0; j < s->m; j++)
      if (s->flag[j]) s->list[s->closed++] = j;
  }
  return fresh;
}

static int off(const Scene *s) {
  int rough = 0, bad = 0;
  for (int i = 0; i < s->closed; i++) {
    int o = (int)s->list[i];
    double mobility = s->h * s->D[o * s->m + o], r = size(s->law[o] - s->F[o]), reach = size(s->y1[o]) + size(s->free[o]);
    rough += !(r <= EPS * (size(s->law[o]) + reach * size(s->J[o])));
    bad += !(mobility * r <= TOLERANCE * reach * (1 - mobility * s->J[o]));
  }
  return !rough ? 0 : !bad ? 1 : 2;
}

static void eliminate(Scene *s) {
  int a = s->closed, m = s->m;
  double *A = s->A, *b = s->next;
  for (int i = 0; i < a; i++) {
    for (int p = 0; p < i; p++) {
      double f = A[i * m + p] * s->scale[p];
      b[i] -= f * b[p];
      for (int j = p + 1; j < a; j++) A[i * m + j] -= f * A[p * m + j];
    }
    s->scale[i] = 1 / A[i * m + i];
  }
  for (int p = a - 1; p >= 0; p--) {
    for (int j = p + 1; j < a; j++) b[p] -= A[p * m + j] * b[j];
    b[p] *= s->scale[p];
  }
}

/* a shorter update of the forces, to where the step potential stops falling */
static void search(Scene *s) {
  double low = 0, high = 1, part = 1;
  for (int k = 0; k < BISECTIONS && low < 1; k++) {
    double rise = 0;
    for (int i = 0; i < s->closed; i++)
      s->y1[(int)s->list[i]] = s->base[i] + part * (s->way[i] - s->base[i]);
    ask(s, 1, 1);
    for (int i = 0; i < s->closed; i++) {
      int o = (int)s->list[i];
      rise += (s->F[o] + part * (s->next[i] - s->F[o]) - s->law[o]) * (s->way[i] - s->base[i]);
    }
    if (rise <= 0) low = part;
    else high = part;
    part = low == 1 ? 1 : 0.5 * (low + high);
  }
  for (int i = 0; i < s->closed; i++) {
    s->next[i] = s->F[(int)s->list[i]] + low * (s->next[i] - s->F[(int)s->list[i]]);
    s->way[i] = s->base[i] + low * (s->way[i] - s->base[i]);
  }
}

static int solved(Scene *s) {
  int m = s->m, near = 0;
  for (int j = 0; j < m; j++) s->y1[j] = s->free[j], s->flag[j] = 0;
  for (int j = 0; j < m; j++)
    for (int i = 0; s->F[j] != 0 && i < m; i++) s->y1[i] += s->h * s->D[j * m + i] * s->F[j];
  int fresh = ask(s, 0, 1);
  if (!fresh) return 1;
  for (int pass = 0; pass < PASSES; pass++) {
    double factor = 1;
    for (int k = pass; k >= RAMP && k < RAMP + 32; k++) factor *= 0.5623413251903491; /* 10^(-1/4) */
    if (!fresh) ask(s, 1, factor);
    int miss = factor == 1 ? off(s) : 2, done = miss == 0 || (miss == 1 && near);
    near = miss == 1;
    if (done) {
      if (fresh || s->closed == m) return 1;
      for (int i = 0; i < m; i++) {
        if (s->flag[i]) continue;
        s->y1[i] = s->free[i];
        for (int t = 0; t < s->closed; t++)
          s->y1[i] += s->h * s->D[(int)s->list[t] * m + i] * s->F[(int)s->list[t]];
      }
      if (!ask(s, 0, 1)) return 1;
    }
    for (int i = 0; i < s->closed; i++) {
      int o = (int)s->list[i];
      for (int j = 0; j < s->closed; j++)
        s->A[i * m + j] = (i == j) - s->h * s->J[o] * s->D[(int)s->list[j] * m + o];
      s->next[i] = s->law[o] + s->J[o] * (s->free[o] - s->y1[o]);
      s->base[i] = s->y1[o];
    }
    eliminate(s);
    for (int i = 0; i < s->closed; i++) {
      int o = (int)s->list[i];
      s->way[i] = s->free[o];
      for (int j = 0; j < s->closed; j++) s->way[i] += s->h * s->D[(int)s->list[j] * m + o] * s->next[j];
    }
    if (pass >= PLAIN && pass < RAMP) search(s);
    for (int i = 0; i < s->closed; i++) s->F[(int)s->list[i]] = s->next[i], s->y1[(int)s->list[i]] = s->way[i];
    fresh = 0;
  }
  return 0;
}

/* displacements and velocities of the points, and forces on the supports along their outward normals */
API void outputs(double *a) {
  Scene s = opened(a);
  for (int i = 0; i < s.watched; i++) {
    s.out[i] = product(s.watch + i * s.n, s.q, s.n);
    s.out[s.watched + i] = product(s.watch + i * s.n, s.v, s.n);
  }
  for (int i = 0; i < s.groups; i++) s.out[2 * s.watched + i] = 0;
  for (int j = 0; j < s.m; j++) {
    const double *c = s.contact + j * COLUMNS;
    s.out[2 * s.watched + (int)c[GROUP]] -= c[SIDE] * s.F[j];
  }
}

/* march so many steps; inputs are VALUE + SLOPE (t - now). Returns 0, or the number of the step that did not converge */
API int march(double *a, int steps) {
  Scene s = opened(a);
  int n = s.n;
  double from = a[BEGIN] + a[COUNT] * s.h;
  if (a[MARK] == 1) set_up(&s);
  for (int k = 0; k < steps; k++) {
    double t = a[BEGIN] + a[COUNT] * s.h + 0.5 * s.h;
    for (int i = 0; i < n; i++) s.drive[i] = 2 / s.h * s.v[i] - s.squares[i] * s.q[i];
    for (int j = 0; j < s.loads; j++) {
      double f = load(s.own + j * NUMBERS, t, t - from);
      for (int i = 0; i < n && f != 0; i++) s.drive[i] += s.patterns[j * n + i] * f;
    }
    answered(&s, s.drive, s.speed);
    for (int j = 0; j < s.m; j++) s.free[j] = s.y[j] + s.h * product(s.rows + j * n, s.speed, n);
    if (!solved(&s)) {
      outputs(a);
      return k + 1;
    }
    int any = 0;
    for (int j = 0; j < s.m; j++) {
      if (s.F[j] != 0)
        for (int i = 0; i < n; i++) s.drive[i] += s.rows[j * n + i] * s.F[j];
      any |= s.F[j] != 0;
      s.y[j] = s.y1[j];
    }
    if (any) answered(&s, s.drive, s.speed);
    for (int i = 0; i < n; i++) {
      s.q[i] += s.h * s.speed[i];
      s.v[i] = 2 * s.speed[i] - s.v[i];
    }
    a[COUNT]++;
  }
  outputs(a);
  return 0;
}
