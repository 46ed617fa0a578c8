(* Theorems 1 and 2 and equation (33) of the paper, for real matrices of every size.

   The statements are those of verification/proofs/statements, written by hand. M is the mass matrix and N its inverse, J
   the contact Jacobian, v and w are the velocities before and after the impact, e the restitution. *)

From Coq Require Import Reals Lra.
From Coq Require Fin FunctionalExtensionality.
Open Scope R_scope.

Ltac at_entry i := apply FunctionalExtensionality.functional_extensionality; intro i.

(* finite sums *)
Fixpoint sum {n} : (Fin.t n -> R) -> R :=
  match n with O => fun _ => 0 | S m => fun f => f Fin.F1 + sum (fun i => f (Fin.FS i)) end.

Lemma sum_same {n} (f g : Fin.t n -> R) : (forall i, f i = g i) -> sum f = sum g.
Proof. intro H. f_equal. at_entry i. apply H. Qed.
Lemma sum_nothing {n} : sum (fun _ : Fin.t n => 0) = 0.
Proof. induction n; simpl; [| rewrite IHn]; lra. Qed.
Lemma sum_plus {n} (f g : Fin.t n -> R) : sum (fun i => f i + g i) = sum f + sum g.
Proof. induction n; simpl; [| rewrite IHn]; lra. Qed.
Lemma sum_times {n} a (f : Fin.t n -> R) : sum (fun i => a * f i) = a * sum f.
Proof. induction n; simpl; [| rewrite IHn]; lra. Qed.
Lemma sum_swap {n m} (f : Fin.t n -> Fin.t m -> R) : sum (fun i => sum (f i)) = sum (fun j => sum (fun i => f i j)).
Proof. induction n; simpl; [symmetry; apply sum_nothing | rewrite IHn; symmetry; apply sum_plus]. Qed.
Lemma sum_squares {n} (f : Fin.t n -> R) : 0 <= sum (fun i => f i * f i).
Proof.
  induction n; simpl; [lra |]. specialize (IHn (fun i => f (Fin.FS i))). pose proof (Rle_0_sqr (f Fin.F1)).
  unfold Rsqr in *. lra.
Qed.
Lemma no_squares {n} (f : Fin.t n -> R) : sum (fun i => f i * f i) = 0 -> forall i, f i = 0.
Proof.
  intros H i. induction i as [| n i IH]; simpl in H; pose proof (Rle_0_sqr (f Fin.F1)) as P;
    pose proof (sum_squares (fun k => f (Fin.FS k))) as Q; unfold Rsqr in P.
  - apply Rsqr_0_uniq. unfold Rsqr. lra.
  - apply (IH (fun k => f (Fin.FS k))). lra.
Qed.

(* vectors of n entries, matrices of r rows and c columns *)
Definition vec n := Fin.t n -> R.
Definition mat r c := Fin.t r -> Fin.t c -> R.
Fixpoint one {n} : mat n n :=
  match n with
  | O => fun _ _ => 0
  | S m => fun i j => Fin.caseS' i (fun _ => R) (Fin.caseS' j (fun _ => R) 1 (fun _ => 0))
      (fun below => Fin.caseS' j (fun _ => R) 0 (fun right => one below right))
  end.
Definition mul {r s c} (A : mat r s) (B : mat s c) : mat r c := fun i j => sum (fun k => A i k * B k j).
Definition tr {r c} (A : mat r c) : mat c r := fun i j => A j i.
Definition times {r c} (A : mat r c) (x : vec c) : vec r := fun i => sum (fun k => A i k * x k).
Definition plus {n} (x y : vec n) : vec n := fun i => x i + y i.
Definition scale {n} a (x : vec n) : vec n := fun i => a * x i.
Definition dot {n} (x y : vec n) := sum (fun i => x i * y i).
Infix "*m" := mul (at level 40, left associativity).
Infix "*v" := times (at level 41, right associativity).
Infix "+v" := plus (at level 50, left associativity).
Notation "A ^T" := (tr A) (at level 8, left associativity, format "A ^T").

Lemma one_times {n} (x : vec n) : one *v x = x.
Proof.
  at_entry i. unfold times. induction i as [| n i IH]; simpl.
  - rewrite (sum_same _ (fun _ => 0)), sum_nothing; [lra | intro; lra].
  - rewrite (IH (fun k => x (Fin.FS k))). lra.
Qed.
Lemma mul_times {r s c} (A : mat r s) (B : mat s c) x : (A *m B) *v x = A *v B *v x.
Proof.
  at_entry i. unfold times, mul.
  rewrite (sum_same _ (fun k => sum (fun j => A i j * B j k * x k))), sum_swap.
  - apply sum_same. intro j. rewrite <- sum_times. apply sum_same. intro k. ring.
  - intro k. rewrite Rmult_comm, <- sum_times. apply sum_same. intro j. ring.
Qed.
Lemma times_plus {r c} (A : mat r c) x y : A *v (x +v y) = (A *v x) +v (A *v y).
Proof. at_entry i. unfold times, plus. rewrite <- sum_plus. apply sum_same. intro; ring. Qed.
Lemma times_scale {r c} (A : mat r c) a x : A *v scale a x = scale a (A *v x).
Proof. at_entry i. unfold times, scale. rewrite <- sum_times. apply sum_same. intro; ring. Qed.
Lemma dot_turned {n} (x y : vec n) : dot x y = dot y x.
Proof. apply sum_same. intro; ring. Qed.
Lemma dot_plus {n} (x y z : vec n) : dot x (y +v z) = dot x y + dot x z.
Proof. unfold dot, plus. rewrite <- sum_plus. apply sum_same. intro; ring. Qed.
Lemma dot_scale {n} a (x y : vec n) : dot x (scale a y) = a * dot x y.
Proof. unfold dot, scale. rewrite <- sum_times. apply sum_same. intro; ring. Qed.
Lemma dot_times {r c} (A : mat r c) x y : dot x (A *v y) = dot (A^T *v x) y.
Proof.
  unfold dot, times, tr.
  rewrite (sum_same _ (fun i => sum (fun k => x i * A i k * y k))), sum_swap.
  - apply sum_same. intro k. rewrite Rmult_comm, <- sum_times. apply sum_same. intro i. ring.
  - intro i. rewrite <- sum_times. apply sum_same. intro k. ring.
Qed.
(* kinetic energy; M is positive definite *)
Definition energy {d} (M : mat d d) (v : vec d) := dot v (M *v v) / 2.
Definition positive {d} (M : mat d d) := forall x : vec d, x <> (fun _ => 0) -> 0 < energy M x.

Lemma energy_zero {d} (M : mat d d) x : positive M -> dot x (M *v x) = 0 -> x = fun _ => 0.
Proof.
  intros P H. at_entry i. destruct (Req_dec (x i) 0) as [Z | Z]; [exact Z |].
  assert (0 < energy M x) as Q; [apply P; intro E; apply Z; rewrite E; reflexivity |].
  unfold energy in Q. lra.
Qed.
Lemma energy_positive {d} (M : mat d d) x : positive M -> 0 <= dot x (M *v x).
Proof.
  intro P. destruct (Rle_lt_dec 0 (dot x (M *v x))) as [H | H]; [exact H |].
  assert (0 < energy M x) as Q; [| unfold energy in Q; lra].
  apply P. intro E. rewrite E in H. unfold dot in H. rewrite (sum_same _ (fun _ => 0)), sum_nothing in H; [lra |].
  intro; ring.
Qed.

(* W G J v = J v follows from W G W = W alone. *)
Lemma row_space {c d} (M N : mat d d) (J : mat c d) (G : mat c c) v :
  M *m N = one -> positive M ->
  J *m N *m J^T *m G *m (J *m N *m J^T) = J *m N *m J^T ->
  J *v N *v J^T *v G *v J *v v = J *v v.
Proof.
  intros inverse definite one_inverse.
  set (W := J *m N *m J^T) in *.
  assert (unfolded : forall x, J *v N *v J^T *v x = W *v x) by (intro; unfold W; rewrite !mul_times; reflexivity).
  assert (short : forall x, W *v G *v W *v x = W *v x).
  { intro x. rewrite <- !mul_times, one_inverse. reflexivity. }
  rewrite unfolded.
  set (r := (W *v G *v J *v v) +v scale (-1) (J *v v)).
  set (t := (G^T *v W^T *v r) +v scale (-1) r).
  assert (none : dot t (W *v t) = 0).
  { unfold t at 1. rewrite dot_turned, dot_plus, dot_scale, !(dot_turned (W *v t)), <- !dot_times, short. ring. }
  assert (pressed : J^T *v t = fun _ => 0).
  { rewrite <- (one_times (J^T *v t)), <- inverse, mul_times.
    rewrite (energy_zero M (N *v J^T *v t)); [| exact definite |].
    - at_entry i. unfold times. rewrite (sum_same _ (fun _ => 0)); [apply sum_nothing | intro; ring].
    - rewrite <- (mul_times M N), inverse, one_times, dot_turned, <- dot_times, unfolded. exact none. }
  assert (zero : dot r r = 0).
  { unfold r at 2. rewrite dot_plus, dot_scale, !dot_times.
    replace (dot (J^T *v G^T *v W^T *v r) v + -1 * dot (J^T *v r) v) with (dot (J^T *v t) v).
    - rewrite pressed. unfold dot. rewrite (sum_same _ (fun _ => 0)); [apply sum_nothing | intro; ring].
    - unfold t. rewrite times_plus, times_scale, dot_turned, dot_plus, dot_scale, !(dot_turned v). reflexivity. }
  at_entry i. pose proof (no_squares r zero i) as E. unfold r, plus, scale in E. lra.
Qed.

Theorem theorem_2 {c d} (M N : mat d d) (J : mat c d) (G : mat c c) (v w : vec d) e :
  M^T = M -> M *m N = one -> positive M ->
  J *m N *m J^T *m G *m (J *m N *m J^T) = J *m N *m J^T ->
  w = v +v scale (- (1 + e)) (N *v J^T *v G *v J *v v) -> -1 <= e <= 1 ->
  J *v w = scale (- e) (J *v v)
  /\ energy M v - energy M w = (1 - e * e) / 2 * dot (J *v v) (G *v J *v v)
  /\ energy M w <= energy M v.
Proof.
  intros symmetric inverse definite one_inverse impact range.
  pose proof (row_space M N J G v inverse definite one_inverse) as rows.
  set (p := G *v J *v v) in *. set (z := N *v J^T *v p) in *.
  assert (push : M *v z = J^T *v p) by (unfold z; rewrite <- mul_times, inverse; apply one_times).
  assert (at_v : dot v (M *v z) = dot (J *v v) p) by (rewrite push, dot_times; reflexivity).
  assert (at_z : dot z (M *v z) = dot (J *v v) p) by (rewrite push, dot_times, <- rows; reflexivity).
  assert (loss : energy M v - energy M w = (1 - e * e) / 2 * dot (J *v v) p).
  { unfold energy. rewrite impact, times_plus, times_scale, !dot_plus, !dot_scale.
    rewrite !(dot_turned (v +v _)), !dot_plus, !dot_scale, !(dot_turned (M *v _)), at_z, at_v.
    rewrite (dot_times M z v), symmetric, (dot_turned (M *v z) v), at_v. field. }
  repeat split; [| exact loss |].
  - rewrite impact, times_plus, times_scale, rows. at_entry i. unfold plus, scale. ring.
  - pose proof (energy_positive M z definite) as P. rewrite at_z in P.
    assert (0 <= (1 - e * e) / 2) by (assert (0 <= (1 - e) * (1 + e)) by (apply Rmult_le_pos; lra); lra).
    pose proof (Rmult_le_pos _ _ H P). lra.
Qed.

(* One row: the impulse is a number, and omega is the inverse of J N J^T. *)
Theorem theorem_1 {d} (M N : mat d d) (J v w : vec d) omega e :
  M^T = M -> M *m N = one -> positive M -> dot J (N *v J) * omega = 1 ->
  w = v +v scale (- (1 + e) * omega * dot J v) (N *v J) -> -1 <= e <= 1 ->
  dot J w = - e * dot J v
  /\ energy M v - energy M w = (1 - e * e) / 2 * (omega * dot J v * dot J v)
  /\ energy M w <= energy M v.
Proof.
  intros symmetric inverse definite one_inverse impact range.
  set (row := (fun _ => J) : mat 1 d). set (G := (fun _ _ => omega) : mat 1 1).
  assert (row_times : forall x, row *v x = fun _ => dot J x) by reflexivity.
  assert (back : forall y : vec 1, row^T *v y = scale (y Fin.F1) J).
  { intro y. at_entry i. unfold times, tr, row, scale. simpl. ring. }
  assert (G_times : forall y : vec 1, G *v y = fun _ => omega * y Fin.F1).
  { intro y. at_entry i. unfold times, G. simpl. ring. }
  assert (W : row *m N *m row^T = fun _ _ => dot J (N *v J)).
  { at_entry i. at_entry j. change ((row *m N *m row^T) i j) with (((row *m N) *v J) i).
    rewrite mul_times. reflexivity. }
  destruct (theorem_2 M N row G v w e symmetric inverse definite) as (newton & loss & none).
  - rewrite W. at_entry i. at_entry j. unfold mul, G. simpl.
    replace (dot J (N *v J)) with (dot J (N *v J) * omega * dot J (N *v J)) at 3 by (rewrite one_inverse; ring). ring.
  - rewrite impact, row_times, G_times, back, times_scale. at_entry i. unfold plus, scale. ring.
  - exact range.
  - rewrite !row_times in *. repeat split.
    + apply (f_equal (fun f => f Fin.F1)) in newton. exact newton.
    + rewrite loss, G_times. unfold dot at 1. simpl. ring.
    + exact none.
Qed.

(* (33): redundant rows J = S K of independent rows K, chosen by C, with L the inverse of K N K^T. *)
Lemma mul_assoc {p q r s} (A : mat p q) (B : mat q r) (C : mat r s) : A *m (B *m C) = A *m B *m C.
Proof.
  at_entry i. at_entry j. symmetry. exact (f_equal (fun f => f i) (mul_times A B (fun k => C k j))).
Qed.
Lemma one_mul {r c} (A : mat r c) : one *m A = A.
Proof. at_entry i. at_entry j. exact (f_equal (fun f => f i) (one_times (fun k => A k j))). Qed.
Lemma tr_mul {r s c} (A : mat r s) (B : mat s c) : (A *m B)^T = B^T *m A^T.
Proof. at_entry i. at_entry j. apply sum_same. intro k. apply Rmult_comm. Qed.
Lemma tr_one {n} : one^T = one :> mat n n.
Proof.
  at_entry i. at_entry j. unfold tr. induction n as [| n IH]; [inversion i |].
  apply (Fin.caseS' i (fun i => one j i = one i j)); [| intro below];
    apply (Fin.caseS' j (fun j => one j _ = one _ j)); simpl; auto.
Qed.
Lemma mul_one {r c} (A : mat r c) : A *m one = A.
Proof.
  transitivity ((one *m A^T)^T); [rewrite tr_mul, tr_one | rewrite one_mul]; reflexivity.
Qed.

Theorem independent_subset {c d n} (N : mat d d) (J : mat c d) (G : mat c c) (K : mat n d) (L : mat n n)
  (S : mat c n) (C : mat n c) :
  J = S *m K -> C *m S = one -> L *m (K *m N *m K^T) = one -> K *m N *m K^T *m L = one ->
  J *m N *m J^T *m G *m (J *m N *m J^T) = J *m N *m J^T -> J^T *m G *m J = K^T *m L *m K.
Proof.
  intros rows choice left right one_inverse.
  set (W := K *m N *m K^T) in *.
  assert (chosen : C *m J = K) by (rewrite rows, mul_assoc, choice; apply one_mul).
  assert (turned : J^T *m C^T = K^T) by (rewrite <- tr_mul, chosen; reflexivity).
  assert (split : J^T = K^T *m S^T) by (rewrite rows; apply tr_mul).
  assert (squeezed : W *m (S^T *m G *m S) *m W = W).
  { transitivity (C *m (J *m N *m J^T *m G *m (J *m N *m J^T)) *m C^T).
    - rewrite split at 1. rewrite rows at 2. unfold W. rewrite <- turned at 2. rewrite <- chosen at 1.
      rewrite !mul_assoc. reflexivity.
    - rewrite one_inverse. unfold W. rewrite <- turned, <- chosen at 1. rewrite !mul_assoc. reflexivity. }
  assert (core : S^T *m G *m S = L).
  { transitivity (L *m (W *m (S^T *m G *m S) *m W) *m L).
    - rewrite !mul_assoc, left, one_mul, <- !mul_assoc, right, mul_one. reflexivity.
    - rewrite squeezed, left. apply one_mul. }
  rewrite split, rows, <- core, !mul_assoc. reflexivity.
Qed.

Print Assumptions theorem_1.
Print Assumptions theorem_2.
Print Assumptions independent_subset.
