(* What the resolver's last step accepts (iapb/contact/kernels/passive.py): never a gain of kinetic energy, for every
  size
   d <= 2^15, every M and every pair of velocities in binary64, infinities and NaN included.

   [never_gains_in_binary64]: if the bound that `gain` computes is finite and at most 0, then w'Mw <= v'Mv over the real
   numbers. Overflow needs no bound of its own: an operation of binary64 with a finite result has finite arguments and
   rounds as if exponents had no upper end ([same]), and every number that `gain` computes enters its bound.
   [margins]: the
   radius that `gain` returns exceeds the error of [gain_error] for every d. *)

From Coq Require Import ZArith Reals List Lia Lra Psatz.
From Flocq Require Import Core BinarySingleNaN.
Require Import Passive.
Import ListNotations.
Open Scope R_scope.

(* The code of `gain`, over any arithmetic: real numbers rounded to binary64's format without an upper end
  (`unbounded`),
   and binary64 itself, with infinities and NaN (`binary64`). *)
Record arithmetic := Arithmetic {
  carrier :> Type; plus : carrier -> carrier -> carrier; minus : carrier -> carrier -> carrier;
  times : carrier -> carrier -> carrier; absolute : carrier -> carrier; opposite : carrier -> carrier;
  nought : carrier; one : carrier; split : carrier }.
Arguments plus {_}. Arguments minus {_}. Arguments times {_}. Arguments absolute {_}. Arguments opposite {_}.
Arguments nought {_}. Arguments one {_}. Arguments split {_}.

Section Code.
Variable T : arithmetic.
Implicit Types a b : T.
Definition sum2 a b : T * T :=
  let s := plus a b in let t := minus s a in (s, plus (minus a (minus s t)) (minus b t)).
Definition high2 a : T := let t := times split a in minus t (minus t a).
Definition product2 a b : T * T :=
  let p := times a b in
  let a_hi := high2 a in let a_lo := minus a a_hi in
  let b_hi := high2 b in let b_lo := minus b b_hi in
  (p, plus (plus (plus (minus (times a_hi b_hi) p) (times a_hi b_lo)) (times a_lo b_hi)) (times a_lo b_lo)).
(* One term (x_hi + x_lo)(y_hi + y_lo) of a loop: the new h, l, and the product of the high parts. *)
Definition add_term (h l x_hi x_lo y_hi y_lo : T) : T * T * T :=
  let pe := product2 x_hi y_hi in let c := plus (times x_hi y_lo) (times x_lo y_hi) in
  let ht := sum2 h (fst pe) in (fst ht, plus l (plus (plus (snd ht) (snd pe)) c), fst pe).
(* The loop over j, on (M_ij, M_ji, w_j, v_j);
  and the loop over i, on (w_i, v_i) with its row: high, low, size, moved. *)
Definition inner (state : T * T * T) (x : T * T * T * T) : T * T * T :=
  let '(h, l, size) := state in let '(m, mirrored, w, v) := x in
  let a := sum2 m mirrored in let s := sum2 w v in
  let '(h', l', p) := add_term h l (fst a) (snd a) (fst s) (snd s) in (h', l', plus size (absolute p)).
Definition outer_loop (state : T * T * T * T) (x : T * T * list (T * T * T * T)) : T * T * T * T :=
  let '(high, low, size, moved) := state in let '(w, v, row) := x in
  let '(h, l, row_size) := fold_left inner row (nought, nought, nought) in
  let d := sum2 w (opposite v) in
  let '(high', low', _) := add_term high low (fst d) (snd d) h l in
  (high', low', plus size (times (absolute (fst d)) row_size), plus moved (absolute (fst d))).
(* share = 2 (d+6)² u² and floor = d 2⁻¹⁰²⁰ are exact for d <= 2¹⁵. *)
Definition upper (share floor : T) (rows : list (T * T * list (T * T * T * T))) : T * T :=
  let '(high, low, size, moved) := fold_left outer_loop rows (nought, nought, nought, nought) in
  (plus high (plus low (plus (times share size) (times floor (plus one moved)))), moved).
Definition rows_of (d : nat) (M : nat -> nat -> T) (v w : nat -> T) : list (T * T * list (T * T * T * T)) :=
  map (fun i => (w i, v i, map (fun j => (M i j, M j i, w j, v j)) (seq 0 d))) (seq 0 d).
End Code.

Definition unbounded := Arithmetic R add subtract multiply Rabs Ropp 0 1 splitter.
#[export] Instance precision_below_exponent : Prec_lt_emax 53 1024 := eq_refl.
Definition double := binary_float 53 1024.
Definition binary64 := Arithmetic double (Bplus mode_NE) (Bminus mode_NE) (Bmult mode_NE) Babs (@Bopp 53 1024)
  (B754_zero false) (@B754_finite 53 1024 false 4503599627370496 (-52) eq_refl)
  (@B754_finite 53 1024 false 4503599660924928 (-25) eq_refl).

(* What is finite is what the arithmetic without an upper end gives. *)
Definition same (x : binary64) (y : unbounded) := is_finite x = true -> B2R x = y.

Lemma overflow_is_not_finite (x : double) s : B2SF x = binary_overflow 53 1024 mode_NE s -> is_finite x = false.
Proof. intro H. rewrite <- is_finite_SF_B2SF, H. reflexivity. Qed.

Lemma same_plus x y x' y' : same x x' -> same y y' -> same (plus x y) (plus x' y').
Proof.
  intros Hx Hy F. change (is_finite (Bplus mode_NE x y) = true) in F.
  assert (is_finite x = true /\ is_finite y = true) as [Fx Fy]
    by (destruct x as [sx| sx| | sx mx ex bx], y as [sy| sy| | sy my ey by']; simpl in *; try discriminate;
        try (destruct (Bool.eqb sx sy); discriminate); auto).
  pose proof (Bplus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C. destruct (Rlt_bool _ _).
  - rewrite <- (Hx Fx), <- (Hy Fy). exact (proj1 C).
  - destruct C as [C _]. rewrite (overflow_is_not_finite _ _ C) in F. discriminate.
Qed.

Lemma same_minus x y x' y' : same x x' -> same y y' -> same (minus x y) (minus x' y').
Proof.
  intros Hx Hy F. change (is_finite (Bminus mode_NE x y) = true) in F.
  assert (is_finite x = true /\ is_finite y = true) as [Fx Fy]
    by (destruct x as [sx| sx| | sx mx ex bx], y as [sy| sy| | sy my ey by']; simpl in *; try discriminate;
        try (destruct (Bool.eqb sx (negb sy)); discriminate); auto).
  pose proof (Bminus_correct 53 1024 _ _ mode_NE x y Fx Fy) as C. destruct (Rlt_bool _ _).
  - rewrite <- (Hx Fx), <- (Hy Fy). exact (proj1 C).
  - destruct C as [C _]. rewrite (overflow_is_not_finite _ _ C) in F. discriminate.
Qed.

Lemma same_times x y x' y' : same x x' -> same y y' -> same (times x y) (times x' y').
Proof.
  intros Hx Hy F. change (is_finite (Bmult mode_NE x y) = true) in F.
  assert (is_finite x = true /\ is_finite y = true) as [Fx Fy]
    by (destruct x as [sx| sx| | sx mx ex bx], y as [sy| sy| | sy my ey by']; simpl in *; try discriminate; auto).
  pose proof (Bmult_correct 53 1024 _ _ mode_NE x y) as C. destruct (Rlt_bool _ _).
  - rewrite <- (Hx Fx), <- (Hy Fy). exact (proj1 C).
  - rewrite (overflow_is_not_finite _ _ C) in F. discriminate.
Qed.

Lemma same_absolute x x' : same x x' -> same (absolute x) (absolute x').
Proof. intros Hx F. change (is_finite (Babs x) = true) in F. rewrite is_finite_Babs in F. rewrite <- (Hx F).
apply B2R_Babs. Qed.

Lemma same_opposite x x' : same x x' -> same (opposite x) (opposite x').
Proof. intros Hx F. change (is_finite (Bopp x) = true) in F. rewrite is_finite_Bopp in F. rewrite <- (Hx F).
apply B2R_Bopp. Qed.

Lemma same_nought : same nought nought.
Proof. intros _. reflexivity. Qed.
Lemma same_one : same one one.
Proof. intros _. simpl. unfold F2R; simpl. lra. Qed.
Lemma same_split : same split split.
Proof. intros _. simpl. unfold splitter, F2R; simpl. lra. Qed.

Lemma same_fold {X Y S S' : Type} (R : S -> S' -> Prop) (Q : X -> Y -> Prop) f g xs ys :
  (forall s s' x y, R s s' -> Q x y -> R (f s x) (g s' y)) -> Forall2 Q xs ys ->
  forall s s', R s s' -> R (fold_left f xs s) (fold_left g ys s').
Proof. intros Hf HQ. induction HQ as [| x y xs ys H _ IH]; intros s s' Hs; simpl; [exact Hs | apply IH, Hf;
  assumption]. Qed.

#[local] Hint Resolve same_plus same_minus same_times same_absolute same_opposite same_nought same_one same_split :
  same.

Definition same3 (x : binary64 * binary64 * binary64) (y : unbounded * unbounded * unbounded) :=
  same (fst (fst x)) (fst (fst y)) /\ same (snd (fst x)) (snd (fst y)) /\ same (snd x) (snd y).
Definition same4 (x : binary64 * binary64 * binary64 * binary64) (y : unbounded * unbounded * unbounded * unbounded) :=
  same3 (fst x) (fst y) /\ same (snd x) (snd y).
Definition same_row (x : binary64 * binary64 * list (binary64 * binary64 * binary64 * binary64))
  (y : unbounded * unbounded * list (unbounded * unbounded * unbounded * unbounded)) :=
  same (fst (fst x)) (fst (fst y)) /\ same (snd (fst x)) (snd (fst y)) /\ Forall2 same4 (snd x) (snd y).

Lemma same_add_term h l a b c d h' l' a' b' c' d' :
  same h h' -> same l l' -> same a a' -> same b b' -> same c c' -> same d d' ->
  same3 (add_term binary64 h l a b c d) (add_term unbounded h' l' a' b' c' d').
Proof.
  intros. unfold same3, add_term, sum2, product2, high2; cbv zeta; cbn [fst snd]. auto 30 with same.
Qed.

Lemma same_inner s s' x x' : same3 s s' -> same4 x x' -> same3 (inner binary64 s x) (inner unbounded s' x').
Proof.
  destruct s as [[h l] z], s' as [[h' l'] z'], x as [[[m n] w] v], x' as [[[m' n'] w'] v'].
  unfold same4, same3; cbn [fst snd]. intros (Hh & Hl & Hz) ((Hm & Hn & Hw) & Hv). unfold inner.
  pose proof (same_add_term h l (fst (sum2 binary64 m n)) (snd (sum2 binary64 m n)) (fst (sum2 binary64 w v))
    (snd (sum2 binary64 w v)) h' l' (fst (sum2 unbounded m' n')) (snd (sum2 unbounded m' n'))
    (fst (sum2 unbounded w' v')) (snd (sum2 unbounded w' v'))) as A.
  destruct (add_term binary64 h l _ _ _ _) as [[h1 l1] p1], (add_term unbounded h' l' _ _ _ _) as [[h1' l1'] p1'].
  destruct A as (A1 & A2 & A3); try assumption;
    try (unfold sum2; cbv zeta; cbn [fst snd]; auto 30 with same).
Qed.

Lemma same_outer s s' x x' : same4 s s' -> same_row x x' -> same4 (outer_loop binary64 s x)
  (outer_loop unbounded s' x').
Proof.
  destruct s as [[[h l] z] k], s' as [[[h' l'] z'] k'], x as [[w v] row], x' as [[w' v'] row'].
  unfold same4, same_row, same3; cbn [fst snd]. intros ((Hh & Hl & Hz) & Hk) (Hw & Hv & Hrow). unfold outer_loop.
  assert (I : same3 (fold_left (inner binary64) row (nought, nought, nought))
                    (fold_left (inner unbounded) row' (nought, nought, nought))).
  { apply (same_fold same3 same4); [exact same_inner | exact Hrow |]. unfold same3; cbn [fst snd]. auto with same. }
  destruct (fold_left (inner binary64) row _) as [[rh rl] rz], (fold_left (inner unbounded) row' _) as [[rh' rl'] rz'].
  destruct I as (I1 & I2 & I3); cbn [fst snd] in *.
  pose proof (same_add_term h l (fst (sum2 binary64 w (opposite v))) (snd (sum2 binary64 w (opposite v))) rh rl
    h' l' (fst (sum2 unbounded w' (opposite v'))) (snd (sum2 unbounded w' (opposite v'))) rh' rl') as A.
  destruct (add_term binary64 h l _ _ _ _) as [[h1 l1] p1], (add_term unbounded h' l' _ _ _ _) as [[h1' l1'] p1'].
  destruct A as (A1 & A2 & A3); try assumption;
    try (unfold sum2; cbv zeta; cbn [fst snd]; auto 30 with same).
Qed.

Lemma same_upper share share' floor floor' rows rows' : same share share' -> same floor floor' ->
  Forall2 same_row rows rows' ->
  same (fst (upper binary64 share floor rows)) (fst (upper unbounded share' floor' rows')) /\
  same (snd (upper binary64 share floor rows)) (snd (upper unbounded share' floor' rows')).
Proof.
  intros Hs Hf H. unfold upper.
  assert (I : same4 (fold_left (outer_loop binary64) rows (nought, nought, nought, nought))
                    (fold_left (outer_loop unbounded) rows' (nought, nought, nought, nought))).
  { apply (same_fold same4 same_row); [exact same_outer | exact H |]. unfold same4, same3;
      cbn [fst snd]. auto with same. }
  destruct (fold_left (outer_loop binary64) rows _) as [[[h l] z] k], (fold_left (outer_loop unbounded) rows' _)
    as [[[h' l'] z'] k'].
  destruct I as ((I1 & I2 & I3) & I4); cbn [fst snd] in *. auto 30 with same.
Qed.

Lemma same_rows d M v w :
  Forall2 same_row (rows_of binary64 d M v w)
    (rows_of unbounded d (fun i j => B2R (M i j)) (fun i => B2R (v i)) (fun i => B2R (w i))).
Proof.
  assert (P : forall (X Y : Type) (Q : X -> Y -> Prop) f g (l : list nat), (forall i, Q (f i) (g i))
    -> Forall2 Q (map f l) (map g l)).
  { intros X Y Q f g l H. induction l; constructor; auto. }
  apply P. intro i. unfold same_row, same; cbn [fst snd]. repeat split; auto.
  apply P. intro j. unfold same4, same3, same; cbn [fst snd]. auto.
Qed.

(* [upper] without an upper end is the sum of the rows of `gain_error`. *)
Definition of_entry (x : R * R * R * R) := let '(m, mirrored, w, v) := x in entry m mirrored w v.
Definition of_row (x : R * R * list (R * R * R * R)) :=
  let '(w, v, row) := x in Row (fst (two_sum w (- v))) (snd (two_sum w (- v))) (map of_entry row).
(* The computed sums of magnitudes. *)
Definition size_of (l : list factors) := fold_left add (map (fun t => Rabs (fst (two_product (x_hi t) (y_hi t)))) l).
Definition sizes_of (l : list row) :=
  fold_left add (map (fun r => multiply (Rabs (d_hi r)) (size_of (entries r) 0)) l).
Definition moved_of (l : list row) := fold_left add (map (fun r => Rabs (d_hi r)) l).

Lemma sum2_unbounded a b : sum2 unbounded a b = two_sum a b.
Proof. reflexivity. Qed.
Lemma product2_unbounded a b : product2 unbounded a b = two_product a b.
Proof. reflexivity. Qed.

Lemma add_term_unbounded (h l a b c d : R) m :
  add_term unbounded h l a b c d =
  (step (h, l) (product_term (Factors a b c d m)), fst (two_product a c)).
Proof. unfold add_term. rewrite product2_unbounded, sum2_unbounded. reflexivity. Qed.

Lemma inner_step (h l z : R) x :
  inner unbounded (h, l, z) x =
  (step (h, l) (product_term (of_entry x)), add z (Rabs (fst (two_product (x_hi (of_entry x)) (y_hi (of_entry x)))))).
Proof.
  destruct x as [[[m n] w] v]. unfold inner, of_entry, entry. rewrite !sum2_unbounded. cbv zeta.
  rewrite (add_term_unbounded _ _ _ _ _ _ (Rabs (fst (two_sum w v)))).
  destruct (step (h, l) _) as [h' l']. reflexivity.
Qed.

Lemma inner_sum row : forall h l z : R,
  fold_left (inner unbounded) row (h, l, z) =
  (fold_left step (map product_term (map of_entry row)) (h, l), size_of (map of_entry row) z).
Proof.
  unfold size_of. induction row as [| x row IH]; intros h l z; [reflexivity |].
  cbn [fold_left map]. rewrite inner_step. destruct (step (h, l) _) as [h' l']. apply IH.
Qed.

Lemma outer_step G (high low z k : R) w v row :
  outer_loop unbounded (high, low, z, k) (w, v, row) =
  (step (high, low) (product_term (outer G (of_row (w, v, row)))),
   add z (multiply (Rabs (d_hi (of_row (w, v, row)))) (size_of (map of_entry row) 0)),
   add k (Rabs (d_hi (of_row (w, v, row))))).
Proof.
  unfold outer_loop.
  replace (fold_left (inner unbounded) row (nought, nought, nought)) with
    (fold_left step (map product_term (map of_entry row)) (0, 0), size_of (map of_entry row) 0)
    by (symmetry; exact (inner_sum row 0 0 0)). change (opposite v) with (- v)%R. rewrite sum2_unbounded. cbv zeta.
  unfold outer, row_sum, summed, of_row. cbn [d_hi d_lo entries].
  generalize (G * row_weight (Row (fst (two_sum w (- v))) (snd (two_sum w (- v))) (map of_entry row))) as weight.
  generalize (size_of (map of_entry row) 0) as size. generalize (two_sum w (- v)) as d.
  change (list (unbounded * unbounded * unbounded * unbounded)) with (list (R * R * R * R)) in row.
  generalize (fold_left step (map product_term (map of_entry row)) (0, 0)) as s. intros [h l] d size weight.
  cbn [fst snd]. rewrite (add_term_unbounded _ _ _ _ _ _ weight). destruct (step (high, low) _) as [h' l']. reflexivity.
Qed.

Lemma outer_sum G rows : forall high low z k : R,
  fold_left (outer_loop unbounded) rows (high, low, z, k) =
  (fold_left step (map product_term (map (outer G) (map of_row rows))) (high, low),
   sizes_of (map of_row rows) z, moved_of (map of_row rows) k).
Proof.
  unfold sizes_of, moved_of. induction rows as [| x rows IH]; intros high low z k; [reflexivity |].
  destruct x as [[w v] row]. cbn [fold_left map]. rewrite (outer_step G). destruct (step (high, low) _) as [h' l'].
  apply IH.
Qed.

Definition grown n := 1 + 2 * (n + 2) * u.
Definition kept n := 1 - n * u.
Definition share_of n := 2 * ((n + 6) * (n + 6)) * (u * u).
(* Lower bound of the returned radius less what `accepted_never_gains` asks for;
  W = sum of |d_i a_ij s_j|, X = eta times
   the sum of |d_i|, Y = eta. *)
Definition row_errors n W X := let G := grown n in
  (1 + u) * (error_bound ((1 + u) * W + n * X) G (4 * X) ((1 + u) * (u + u)) (2 * X) n ((1 + u) * W + n * X)
             + (u * u * (5 + 2 * u)) * W + 5 * n * X).
Definition q2 n := n * (u * grown n) + (u + (1 + u) * (u + u)).
Definition g2 n := (1 + u) * (q2 n + u).
Definition f2 n X Y := (1 + u) * (1 + u) * (6 * n * grown n * X) + 2 * Y.
Definition all_weights n W X Y := (1 + u) * (grown n * ((1 + u) * W + n * X)) + n * Y.
Definition sum_error n W X Y :=
  error_bound (all_weights n W X Y) (grown n) (4 * Y) (g2 n) (f2 n X Y) n (all_weights n W X Y).
Definition rests n W X Y := let V := grown n * ((1 + u) * W + n * X) in
  u * (3 + u) * (q2 n * V + 6 * n * grown n * X) + u * (2 + u) * (u * V) + 5 * n * Y.
Definition low_part n W X Y := grown n * low_bound (all_weights n W X Y) (grown n) (4 * Y) (g2 n) (f2 n X Y)
  n (all_weights n W X Y).
Definition least_size n W X Y := kept n * ((1 - u) * (kept n * ((1 - u) * W - n * X / 2)) - n * Y / 2).
Definition least_radius n W X Y := (1 - u) * (((1 - u) * (share_of n * least_size n W X Y) - Y / 2) +
  ((1 - u) * (n * 18014398509481984 * ((1 - u) * (Y + kept n * X))) - Y / 2)).
Definition margin n W X Y :=
  (1 - u) * least_radius n W X Y - (sum_error n W X Y + rests n W X Y + row_errors n W X + u * low_part n W X Y).

Lemma margin_linear n W X Y : margin n W X Y = W * margin n 1 0 0 + X * margin n 0 1 0 + Y * margin n 0 0 1.
Proof.
  unfold margin, least_radius, least_size, low_part, rests, sum_error, row_errors, all_weights, f2, error_bound,
    low_bound.
  field.
Qed.

Lemma margins n : 1 <= n <= 32768 -> 0 <= margin n 1 0 0 /\ 0 <= margin n 0 1 0 /\ 0 <= margin n 0 0 1.
Proof.
  intros Hn.
  assert (P : forall k, 0 <= n ^ k /\ n ^ (S k) <= 32768 * n ^ k).
  { intro k. assert (0 <= n ^ k) by (apply pow_le; lra). split; [assumption |]. simpl. apply Rmult_le_compat_r; lra. }
  pose proof (P 1%nat). pose proof (P 2%nat). pose proof (P 3%nat). pose proof (P 4%nat). pose proof (P 5%nat).
  pose proof (P 6%nat). pose proof (P 7%nat). pose proof (P 8%nat). clear P.
  unfold margin, least_radius, least_size, low_part, rests, sum_error, row_errors, all_weights, f2, g2, q2,
    error_bound, low_bound, grown, kept, share_of.
  rewrite u_value. repeat split; lra.
Qed.

Definition over {X} (f : X -> R) (l : list X) := fold_right (fun x rest => f x + rest) 0 l.

Lemma over_scaled {X} c (f : X -> R) l : over (fun x => c * f x) l = c * over f l.
Proof. induction l as [| x l IH]; simpl; [ring | rewrite IH; ring]. Qed.
Lemma over_sum {X} (f g : X -> R) l : over (fun x => f x + g x) l = over f l + over g l.
Proof. induction l as [| x l IH]; simpl; [ring | rewrite IH; ring]. Qed.
Lemma over_constant {X} c (l : list X) : over (fun _ => c) l = INR (length l) * c.
Proof. induction l as [| x l IH]; [simpl;
  ring |]. cbn [length over fold_right]. fold (over (fun _ : X => c) l). rewrite IH, S_INR. ring. Qed.
Lemma over_below {X} (f g : X -> R) l : Forall (fun x => f x <= g x) l -> over f l <= over g l.
Proof. intro H. induction H; simpl; [lra |]. apply Rplus_le_compat; assumption. Qed.
Lemma over_positive {X} (f : X -> R) l : Forall (fun x => 0 <= f x) l -> 0 <= over f l.
Proof. intro H. induction H; simpl; [lra |]. lra. Qed.
Lemma over_member {X} (f : X -> R) l x : (forall x, 0 <= f x) -> In x l -> f x <= over f l.
Proof.
  intros P H. induction l as [| y l IH]; [destruct H |]. simpl. pose proof (P y).
  assert (0 <= over f l) by (apply over_positive, Forall_forall; auto).
  destruct H as [-> | H]; [lra | specialize (IH H); lra].
Qed.

Lemma power_kept k : 1 - INR k * u <= (1 - u) ^ k.
Proof.
  pose proof u_positive. assert (u < 1) by (rewrite u_value; lra).
  induction k as [| k IH]; [simpl; lra |]. rewrite S_INR. simpl. pose proof (pos_INR k).
  assert (0 <= INR k * u * u) by (apply Rmult_le_pos; [apply Rmult_le_pos |]; lra).
  apply Rle_trans with ((1 - u) * (1 - INR k * u)); [lra | apply Rmult_le_compat_l; lra].
Qed.

Lemma power_grown k : INR k * u <= / 4 -> (1 + u) ^ k <= 1 + 2 * INR k * u.
Proof.
  pose proof u_positive as Hu.
  induction k as [| k IH]; [simpl; lra |]. rewrite S_INR. intro H. pose proof (pos_INR k) as Hk.
  assert (INR k * u <= / 4) by lra. specialize (IH ltac:(assumption)). simpl.
  apply Rle_trans with ((1 + u) * (1 + 2 * INR k * u)); [apply Rmult_le_compat_l; lra |].
  assert (INR k * u * u <= / 4 * u) by (apply Rmult_le_compat_r; lra). lra.
Qed.

(* A computed sum of non-negative numbers loses at most u of itself a term. *)
Lemma sum_kept l : Forall (fun x => number x /\ 0 <= x) l -> forall s, number s -> 0 <= s ->
  (1 - u) ^ length l * (s + over (fun x => x) l) <= fold_left add l s.
Proof.
  pose proof u_positive as Hu. assert (u < 1) by (rewrite u_value; lra).
  intro F. induction F as [| x l (Fx & Px) F IH]; intros s Fs Ps; simpl; [lra |].
  pose proof (add_near s x Fs Fx) as A. rewrite (Rabs_pos_eq (s + x)) in A by lra.
  pose proof (Rle_abs (s + x - add s x)).
  assert (L : (1 - u) * (s + x) <= add s x) by lra.
  assert (0 <= (1 - u) * (s + x)) by (apply Rmult_le_pos; lra).
  specialize (IH (add s x) (number_round _) ltac:(lra)).
  assert (P : 0 <= over (fun x => x) l).
  { apply over_positive. apply Forall_impl with (2 := F). intros y Hy. apply Hy. }
  apply Rle_trans with (2 := IH).
  assert (0 <= (1 - u) ^ length l) by (apply pow_le; lra).
  replace ((1 - u) * (1 - u) ^ length l * (s + (x + over (fun x => x) l))) with
    ((1 - u) ^ length l * ((1 - u) * (s + x) + (1 - u) * over (fun x => x) l)) by ring.
  apply Rmult_le_compat_l; [assumption |].
  assert (0 <= u * over (fun x => x) l) by (apply Rmult_le_pos; lra). fold (over (fun x : R => x) l). lra.
Qed.

Lemma multiply_kept x y : 0 <= x * y -> (1 - u) * (x * y) - / 2 * eta <= multiply x y.
Proof.
  intro H. pose proof (multiply_near x y) as M. rewrite (Rabs_pos_eq (x * y) H) in M.
  pose proof (Rle_abs (x * y - multiply x y)). lra.
Qed.

Lemma multiply_positive x y : 0 <= x * y -> 0 <= multiply x y.
Proof. intro H. unfold multiply. rewrite <- (round_0 radix2 fexp ZnearestE). apply round_le;
  [typeclasses eauto .. | exact H]. Qed.

Section Accepted.
Variables (d : nat) (A : R).
Hypotheses (d_positive : (1 <= d)%nat) (d_small : INR d <= 32768) (A_positive : 0 <= A).
Let n := INR d.

Definition proper (r : row) :=
  length (entries r) = d /\ Forall (fun t => sized u 0 A t /\ m t = Rabs (y_hi t)) (entries r) /\
  number (d_hi r) /\ number (d_lo r) /\ Rabs (d_lo r) <= u * Rabs (d_hi r).
Definition mags (r : row) := over (fun t => Rabs (x_hi t) * m t) (entries r).
Definition change rows := over (fun r => Rabs (d_hi r)) rows.
Definition magnitude rows := over (fun r => Rabs (d_hi r) * mags r) rows.

Lemma n_range : 1 <= n <= 32768.
Proof. split; [| exact d_small]. apply (le_INR 1). exact d_positive. Qed.

Lemma grown_enough : (1 + u) ^ (d + 2) <= grown n.
Proof.
  pose proof n_range. unfold grown. replace (n + 2) with (INR (d + 2)) by (rewrite plus_INR; unfold n; simpl; lra).
  apply power_grown. rewrite plus_INR. fold n. simpl INR. rewrite u_value. lra.
Qed.

Lemma row_weight_value r : proper r -> row_weight r = (1 + u) * mags r + n * eta.
Proof.
  intros (Hd & _). unfold row_weight, mags, n. rewrite <- Hd. clear Hd.
  induction (entries r) as [| t l IH]; [simpl; ring |].
  cbn [map weights fold_right length over]. fold (weights (map product_term l)).
  fold (over (fun t => Rabs (x_hi t) * m t) l).
  rewrite IH, S_INR. unfold product_term; cbn [weight]. ring.
Qed.

Lemma row_rest_value r : proper r -> total (rest u 0) (entries r) = u * u * (5 + 2 * u) * mags r + 5 * n * eta.
Proof.
  intros (Hd & _). unfold mags, n. rewrite <- Hd. clear Hd.
  induction (entries r) as [| t l IH]; [simpl; ring |].
  cbn [total fold_right length over]. fold (total (rest u 0) l). fold (over (fun t => Rabs (x_hi t) * m t) l).
  rewrite IH, S_INR. unfold rest. ring.
Qed.

Lemma weighted rows : Forall proper rows ->
  over (fun r => Rabs (d_hi r) * row_weight r) rows = (1 + u) * magnitude rows + n * (eta * change rows).
Proof.
  intro H. unfold magnitude, change. induction H as [| r rows Hr H IH]; simpl; [ring |].
  rewrite IH, (row_weight_value r Hr). unfold magnitude, change. ring.
Qed.

Lemma weights_value rows : Forall proper rows -> length rows = d ->
  weights (map product_term (map (outer (grown n)) rows)) = all_weights n (magnitude rows) (eta * change rows) eta.
Proof.
  intros H Hd. unfold all_weights. rewrite <- (weighted rows H).
  replace (n * eta) with (INR (length rows) * eta) by (rewrite Hd; reflexivity). clear H Hd.
  induction rows as [| r rows IH]; [simpl; ring |].
  cbn [map weights fold_right length over]. fold (weights (map product_term (map (outer (grown n)) rows))).
  fold (over (fun r => Rabs (d_hi r) * row_weight r) rows). rewrite IH, S_INR.
  unfold product_term, outer; cbn [weight x_hi m]. ring.
Qed.

Lemma rests_value rows z : Forall proper rows -> length rows = d -> z = 6 * n * grown n * eta ->
  total (rest (q2 n) z) (map (outer (grown n)) rows) = rests n (magnitude rows) (eta * change rows) eta.
Proof.
  intros H Hd ->. unfold rests; cbv zeta. rewrite <- (weighted rows H).
  replace (5 * n * eta) with (5 * INR (length rows) * eta) by (rewrite Hd; reflexivity). clear H Hd. unfold change.
  induction rows as [| r rows IH]; [simpl; ring |].
  cbn [map total fold_right length over].
  fold (total (rest (q2 n) (6 * n * grown n * eta)) (map (outer (grown n)) rows)).
  fold (over (fun r => Rabs (d_hi r) * row_weight r) rows). fold (over (fun r => Rabs (d_hi r)) rows).
  rewrite IH, S_INR.
  unfold rest, outer; cbn [x_hi m]. ring.
Qed.

Lemma rows_error_below rows : Forall proper rows ->
  rows_error (grown n) A d rows <= row_errors n (magnitude rows) (eta * change rows).
Proof.
  intro H. unfold row_errors; cbv zeta. rewrite <- (weighted rows H). unfold magnitude, change.
  induction H as [| r rows Hr H IH].
  { simpl. unfold error_bound. right. field. }
  cbn [rows_error over fold_right].
  fold (over (fun r => Rabs (d_hi r) * row_weight r) rows) in *. fold (over (fun r => Rabs (d_hi r)) rows) in *.
  fold (over (fun r => Rabs (d_hi r) * mags r) rows) in *.
  destruct Hr as (Hn & He & Fd & Fdl & Hdl).
  assert (P : 0 <= row_error (grown n) A d r).
  { destruct (loop_error u 0 A ltac:(pose proof u_positive; lra) ltac:(lra) (entries r) (grown n)) as (Hx & _ & _).
    - apply Forall_impl with (2 := He). intros t Ht. apply Ht.
    - exact A_positive.
    - rewrite Hn. exact grown_enough.
    - rewrite Hn in Hx. apply Rle_trans with (2 := Hx). apply Rabs_pos. }
  assert (Q : Rabs (d_hi r + d_lo r) * row_error (grown n) A d r <= (1 + u) * Rabs (d_hi r) * row_error (grown n)
    A d r).
  { apply Rmult_le_compat_r; [exact P |]. apply Rle_trans with (1 := Rabs_triang _ _). lra. }
  assert (E : row_error (grown n) A d r = error_bound (row_weight r) (grown n) (4 * eta) ((1 + u) * (u + u)) (2 * eta)
    n (row_weight r)
    + (u * u * (5 + 2 * u) * mags r + 5 * n * eta)).
  { unfold row_error. rewrite (row_rest_value r) by (unfold proper;
      auto). fold n. rewrite !Rmult_0_r, Rplus_0_l. reflexivity. }
  rewrite E in Q. rewrite E. apply Rle_trans with (1 := Rplus_le_compat _ _ _ _ Q IH).
  right. unfold error_bound. field.
Qed.

Lemma kept_range : 0 <= kept n <= 1.
Proof. pose proof n_range. unfold kept. rewrite u_value. lra. Qed.

Lemma kept_sum (l : list R) below : Forall (fun x => number x /\ 0 <= x) l -> length l = d ->
  below <= over (fun x => x) l -> kept n * below <= fold_left add l 0.
Proof.
  intros F Hd B. apply Rle_trans with (2 := sum_kept l F 0 (generic_format_0 _ _) (Rle_refl 0)). rewrite Rplus_0_l.
  assert (P : 0 <= over (fun x => x) l) by (apply over_positive, Forall_impl with (2 := F); intros x Hx; apply Hx).
  apply Rle_trans with (kept n * over (fun x => x) l).
  - apply Rmult_le_compat_l; [apply kept_range | exact B].
  - apply Rmult_le_compat_r; [exact P |]. rewrite Hd. apply power_kept.
Qed.

Lemma over_map {X} (f : X -> R) l : over (fun x => x) (map f l) = over f l.
Proof. induction l as [| x l IH]; simpl; [reflexivity | rewrite IH; reflexivity]. Qed.

Lemma size_kept r : proper r -> kept n * ((1 - u) * mags r - n * eta / 2) <= size_of (entries r) 0.
Proof.
  intros (Hd & He & _). unfold size_of. apply kept_sum.
  - apply Forall_map, Forall_forall. intros t _. split; [apply generic_format_abs, number_round | apply Rabs_pos].
  - rewrite map_length. exact Hd.
  - rewrite over_map. unfold mags, n. rewrite <- Hd. clear Hd. induction He as [| t l (_ & Hm) He IH]; [simpl; lra |].
    cbn [over fold_right length]. fold (over (fun t => Rabs (x_hi t) * m t) l).
    fold (over (fun t => Rabs (fst (two_product (x_hi t) (y_hi t)))) l). rewrite S_INR.
    change (fst (two_product (x_hi t) (y_hi t))) with (multiply (x_hi t) (y_hi t)).
    pose proof (multiply_near (x_hi t) (y_hi t)) as N.
    pose proof (Rabs_triang_inv (x_hi t * y_hi t) (multiply (x_hi t) (y_hi t))) as T.
    rewrite Rabs_mult, <- Hm in N, T. lra.
Qed.

Lemma size_positive r : 0 <= size_of (entries r) 0.
Proof.
  unfold size_of. assert (P : forall l s, 0 <= s -> 0 <= fold_left add (map (fun t => Rabs (fst (two_product (x_hi t)
    (y_hi t)))) l) s).
  { induction l as [| t l IH]; intros s Hs; simpl; [exact Hs |]. apply IH.
    unfold add. rewrite <- (round_0 radix2 fexp ZnearestE). apply round_le; [typeclasses eauto .. |].
    apply Rplus_le_le_0_compat; [exact Hs | apply Rabs_pos]. }
  apply P. lra.
Qed.

Lemma sizes_kept rows : Forall proper rows -> length rows = d ->
  least_size n (magnitude rows) (eta * change rows) eta <= sizes_of rows 0.
Proof.
  intros H Hd. unfold least_size, sizes_of.
  assert (K := kept_range). assert (u1 : 0 <= 1 - u) by (rewrite u_value; lra).
  apply kept_sum.
  - apply Forall_map, Forall_forall. intros r _. split; [apply number_round |].
    apply multiply_positive, Rmult_le_pos; [apply Rabs_pos | apply size_positive].
  - rewrite map_length. exact Hd.
  - rewrite over_map. replace (n * eta / 2) with (INR (length rows) * eta / 2) by (rewrite Hd; reflexivity). clear Hd.
    unfold magnitude, change. induction H as [| r rows Hr H IH]; [simpl; lra |].
    cbn [over fold_right length]. fold (over (fun r => Rabs (d_hi r) * mags r) rows).
    fold (over (fun r => Rabs (d_hi r)) rows).
    fold (over (fun r => multiply (Rabs (d_hi r)) (size_of (entries r) 0)) rows). rewrite S_INR.
    pose proof (multiply_kept (Rabs (d_hi r)) (size_of (entries r) 0)) as N.
    specialize (N ltac:(apply Rmult_le_pos; [apply Rabs_pos | apply size_positive])).
    pose proof (Rmult_le_compat_l _ _ _ (Rabs_pos (d_hi r)) (size_kept r Hr)) as L.
    apply (Rmult_le_compat_l (1 - u) _ _ u1) in L. lra.
Qed.

Lemma moved_kept rows : length rows = d -> Forall proper rows -> kept n * change rows <= moved_of rows 0.
Proof.
  intros Hd H. unfold moved_of. apply kept_sum.
  - apply Forall_map. apply Forall_impl with (2 := H). intros r (_ & _ & F & _).
    split; [apply generic_format_abs, F | apply Rabs_pos].
  - rewrite map_length. exact Hd.
  - rewrite over_map. right. reflexivity.
Qed.

(* Without an upper end of the exponents: a computed upper bound that is at most 0 shows that nothing is gained. *)
Lemma accepted_unbounded rows : let terms := map product_term (map (outer (grown n)) rows) in
  length rows = d -> Forall proper rows ->
  add (fst (summed terms)) (add (snd (summed terms)) (add (multiply (share_of n) (sizes_of rows 0))
    (multiply (n * 18014398509481984 * eta) (add 1 (moved_of rows 0))))) <= 0 -> gamma rows <= 0.
Proof.
  intros terms Hd H.
  pose proof u_positive as Hu. pose proof eta_positive as He. pose proof n_range as Hn.
  assert (u1 : 0 <= 1 - u) by (rewrite u_value; lra).
  set (W := magnitude rows). set (X := eta * change rows).
  assert (C0 : 0 <= change rows) by (apply over_positive, Forall_forall; intros; apply Rabs_pos).
  assert (X0 : 0 <= X) by (apply Rmult_le_pos; lra).
  assert (W0 : 0 <= W).
  { apply over_positive, Forall_forall. intros r Hr. apply Rmult_le_pos; [apply Rabs_pos |].
    apply over_positive. rewrite Forall_forall in H. destruct (H r Hr) as (_ & F & _).
    apply Forall_impl with (2 := F). intros t (_ & ->). apply Rmult_le_pos; apply Rabs_pos. }
  destruct (gain_error (grown n) A (change rows) d grown_enough A_positive C0 rows Hd) as (E & L).
  { apply Forall_forall. intros r Hr. pose proof (proj1 (Forall_forall _ _) H r Hr) as (Hl & F & Fd & Fl & B).
    unfold row_fits. repeat split; try assumption.
    - apply Forall_impl with (2 := F). intros t Ht. apply Ht.
    - apply (over_member (fun r => Rabs (d_hi r)) rows r); [intros; apply Rabs_pos | exact Hr]. }
  fold n terms in E, L. unfold terms in E, L. rewrite (weights_value rows H Hd) in E, L. fold terms in E, L.
  fold W X in E, L. change (n * (u * grown n) + (u + (1 + u) * (u + u))) with (q2 n) in E, L.
  rewrite (rests_value rows _ H Hd) in E by (rewrite !Rmult_0_r; ring). fold W X in E.
  pose proof (rows_error_below rows H) as RE. fold W X in RE.
  assert (Hf : (1 + u) * (1 + u) * (change rows * (grown n * (n * (4 * eta + ((1 + u) * (1 + u) * (A * 0)
    + 2 * eta))))) + 2 * eta
               = f2 n X eta) by (unfold f2, X; ring).
  rewrite Hf in E, L. change ((1 + u) * (q2 n + u)) with (g2 n) in E, L.
  apply accepted_never_gains; try apply number_round; [apply summed_numbers .. |].
  set (radius := add (multiply _ _) (multiply _ _)).
  pose proof (sizes_kept rows H Hd) as Z. fold W X in Z. pose proof (moved_kept rows Hd H) as M.
  assert (S0 : 0 <= share_of n).
  { unfold share_of. apply Rmult_le_pos; [| apply Rmult_le_pos; lra]. apply Rmult_le_pos; [lra |]. apply Rmult_le_pos;
      lra. }
  assert (Z0 : 0 <= sizes_of rows 0).
  { apply Rle_trans with (kept n * 0); [lra |]. unfold sizes_of. apply kept_sum.
    - apply Forall_map, Forall_forall. intros r _. split; [apply number_round |].
      apply multiply_positive, Rmult_le_pos; [apply Rabs_pos | apply size_positive].
    - rewrite map_length. exact Hd.
    - apply over_positive. apply Forall_map, Forall_forall. intros r _.
      apply multiply_positive, Rmult_le_pos; [apply Rabs_pos | apply size_positive]. }
  assert (M0 : 0 <= moved_of rows 0).
  { apply Rle_trans with (2 := M). apply Rmult_le_pos; [apply kept_range | exact C0]. }
  assert (Fm : number (moved_of rows 0)).
  { unfold moved_of. destruct rows as [| r rows']; [apply generic_format_0 |].
    assert (P : forall l s, number s -> number (fold_left add l s)).
    { induction l as [| x l IH]; intros s Hs; [exact Hs | apply IH, number_round]. }
    apply P, generic_format_0. }
  assert (F1 : number 1) by (apply (generic_format_bpow radix2 fexp 0); unfold fexp, FLT_exp; lia).
  pose proof (multiply_kept (share_of n) (sizes_of rows 0) ltac:(apply Rmult_le_pos; assumption)) as K1.
  assert (A1 : (1 - u) * (1 + moved_of rows 0) <= add 1 (moved_of rows 0)).
  { pose proof (add_near 1 (moved_of rows 0) F1 Fm) as N. rewrite (Rabs_pos_eq (1 + _)) in N by lra.
    pose proof (Rle_abs (1 + moved_of rows 0 - add 1 (moved_of rows 0))). lra. }
  assert (A0 : 0 <= (1 - u) * (1 + moved_of rows 0)) by (apply Rmult_le_pos; lra).
  set (flat := n * 18014398509481984 * eta).
  assert (f0 : 0 <= flat) by (unfold flat; apply Rmult_le_pos; lra).
  assert (FA : 0 <= flat * add 1 (moved_of rows 0)) by (apply Rmult_le_pos; lra).
  pose proof (multiply_kept flat (add 1 (moved_of rows 0)) FA) as K2.
  assert (K3 : flat * ((1 - u) * (1 + kept n * change rows)) <= flat * add 1 (moved_of rows 0)).
  { apply Rmult_le_compat_l; [exact f0 |]. apply Rle_trans with (2 := A1). apply Rmult_le_compat_l; lra. }
  assert (K4 : (1 - u) * (share_of n * least_size n W X eta) <= (1 - u) * (share_of n * sizes_of rows 0))
    by (apply Rmult_le_compat_l; [exact u1 | apply Rmult_le_compat_l; assumption]).
  apply (Rmult_le_compat_l (1 - u) _ _ u1) in K3.
  set (r1 := multiply (share_of n) (sizes_of rows 0)) in *. set (r2 := multiply flat _) in *.
  assert (P1 : 0 <= r1) by (apply multiply_positive, Rmult_le_pos; assumption).
  assert (P2 : 0 <= r2) by (apply multiply_positive; exact FA).
  assert (Fr1 : number r1) by apply number_round. assert (Fr2 : number r2) by apply number_round.
  pose proof (add_near r1 r2 Fr1 Fr2) as N. rewrite (Rabs_pos_eq (r1 + r2)) in N by lra.
  pose proof (Rle_abs (r1 + r2 - add r1 r2)).
  assert (Rad : 0 <= radius) by (assert (0 <= (1 - u) * (r1 + r2)) by (apply Rmult_le_pos; lra);
    change radius with (add r1 r2); lra).
  assert (R : (1 - u) * least_radius n W X eta <= (1 - u) * radius).
  { apply Rmult_le_compat_l; [exact u1 |]. unfold least_radius.
    apply Rle_trans with ((1 - u) * (r1 + r2)); [apply Rmult_le_compat_l;
      [exact u1 |] | change radius with (add r1 r2); lra].
    unfold flat, X in K3. unfold flat in K2.
    replace (n * 18014398509481984 * ((1 - u) * (eta + kept n * X))) with
      (n * 18014398509481984 * eta * ((1 - u) * (1 + kept n * change rows))) by (unfold X; ring).
    lra. }
  assert (Mg : 0 <= margin n W X eta).
  { rewrite margin_linear. destruct (margins n Hn) as (M1 & M2 & M3).
    pose proof (Rmult_le_pos _ _ W0 M1). pose proof (Rmult_le_pos _ _ X0 M2).
    pose proof (Rmult_le_pos eta _ ltac:(lra) M3). lra. }
  unfold margin in Mg.
  assert (Low : u * Rabs (snd (summed terms)) <= u * low_part n W X eta) by (apply Rmult_le_compat_l; [lra | exact L]).
  assert (T : u * Rabs (snd (summed terms) + radius) <= u * Rabs (snd (summed terms)) + u * radius).
  { rewrite <- Rmult_plus_distr_l. apply Rmult_le_compat_l; [lra |]. apply Rle_trans with (1 := Rabs_triang _ _).
    rewrite (Rabs_pos_eq radius Rad). lra. }
  unfold sum_error in Mg. lra.
Qed.
End Accepted.

(* w'Mw, and that gamma of the code's rows is 2 (w'Mw - v'Mv). *)
Definition quadratic d (M : nat -> nat -> R) (x : nat -> R) :=
  over (fun i => over (fun j => x i * M i j * x j) (seq 0 d)) (seq 0 d).

Lemma over_swapped {X Y} (f : X -> Y -> R) k l :
  over (fun i => over (fun j => f i j) l) k = over (fun j => over (fun i => f i j) k) l.
Proof.
  induction k as [| x k IH]; simpl; [rewrite over_constant; ring |]. rewrite IH, <- over_sum. reflexivity.
Qed.

Lemma over_equal {X} (f g : X -> R) l : (forall x, f x = g x) -> over f l = over g l.
Proof. intro H. induction l as [| x l IH]; simpl; [reflexivity | rewrite H, IH; reflexivity]. Qed.

Lemma four_times_gain d M v w :
  over (fun i => (w i - v i) * over (fun j => (M i j + M j i) * (w j + v j)) (seq 0 d)) (seq 0 d) =
  2 * (quadratic d M w - quadratic d M v).
Proof.
  unfold quadratic. set (l := seq 0 d).
  transitivity (over (fun i => over (fun j => (w i - v i) * M i j * (w j + v j)) l) l +
                over (fun i => over (fun j => (w i - v i) * M j i * (w j + v j)) l) l).
  { rewrite <- over_sum. apply over_equal. intro i. rewrite <- over_sum, <- over_scaled. apply over_equal. intro j.
    ring. }
  rewrite (over_swapped (fun i j => (w i - v i) * M j i * (w j + v j))).
  replace (over (fun i => over (fun j => w i * M i j * w j) l) l - over (fun i => over (fun j => v i * M i j * v j) l)
    l)
    with (over (fun i => over (fun j => w i * M i j * w j + -1 * (v i * M i j * v j)) l) l).
  - rewrite <- over_scaled, <- over_sum. apply over_equal. intro i.
    rewrite <- over_scaled, <- over_sum. apply over_equal. intro j. ring.
  - transitivity (over (fun i => over (fun j => w i * M i j * w j) l + -1 * over (fun j => v i * M i j * v j) l) l).
    + apply over_equal. intro i. rewrite <- over_scaled, <- over_sum. reflexivity.
    + rewrite over_sum, over_scaled. ring.
Qed.

Section Matrix.
Variables (d : nat) (M : nat -> nat -> R) (v w : nat -> R).
Hypotheses (d_positive : (1 <= d)%nat) (d_small : INR d <= 32768).
Hypotheses (M_numbers : forall i j, number (M i j)) (v_numbers : forall i, number (v i))
  (w_numbers : forall i, number (w i)).
Let rows := map of_row (rows_of unbounded d M v w).
Definition largest := over (fun i => over (fun j => Rabs (add (M i j) (M j i))) (seq 0 d)) (seq 0 d).

Lemma number_opposite x : number x -> number (- x).
Proof. apply generic_format_opp. Qed.

Lemma rows_proper : Forall (proper d largest) rows.
Proof.
  unfold rows, rows_of. rewrite map_map. apply Forall_map, Forall_forall. intros i Hi.
  unfold proper, of_row; cbn [entries d_hi d_lo]. rewrite map_map.
  split; [rewrite map_length; apply seq_length |].
  split; [| split; [apply number_round | split; [apply number_round |
    apply two_sum_low; [apply w_numbers | apply number_opposite, v_numbers]]]].
  apply Forall_map, Forall_forall. intros j Hj. split; [| reflexivity].
  apply (entry_fits (M i j) (M j i) (w j) (v j) largest); auto.
  unfold largest.
  apply Rle_trans with (over (fun j => Rabs (add (M i j) (M j i))) (seq 0 d)).
  - apply (over_member (fun j => Rabs (add (M i j) (M j i)))); [intro; apply Rabs_pos | exact Hj].
  - apply (over_member (fun i => over (fun j => Rabs (add (M i j) (M j i))) (seq 0 d))); [| exact Hi].
    intro k. apply over_positive, Forall_forall. intros; apply Rabs_pos.
Qed.

Lemma rows_gamma : gamma rows = 2 * (quadratic d M w - quadratic d M v).
Proof.
  rewrite <- four_times_gain. unfold rows, rows_of. rewrite map_map. generalize (seq 0 d) at 2 4 as l.
  induction l as [| i l IH]; [reflexivity |].
  cbn [map gamma]. match goal with |- _ = over ?f _ => change (over f (i :: l)) with (f i + over f l) end.
  rewrite <- IH. f_equal. cbn [of_row d_hi d_lo entries].
  rewrite (two_sum_exact (w i) (- v i)) by auto using number_opposite. f_equal.
  rewrite map_map. clear IH. generalize (seq 0 d) as k. induction k as [| j k IH]; [reflexivity |].
  match goal with |- _ = over ?f _ => change (over f (j :: k)) with (f j + over f k) end. rewrite <- IH.
  cbn [map total fold_right]. f_equal.
  apply (entry_fits (M i j) (M j i) (w j) (v j) (Rabs (add (M i j) (M j i)))); auto. lra.
Qed.

Lemma rows_length : length rows = d.
Proof. unfold rows, rows_of. rewrite !map_length. apply seq_length. Qed.

Lemma largest_positive : 0 <= largest.
Proof. apply over_positive, Forall_forall. intros i _. apply over_positive, Forall_forall. intros; apply Rabs_pos. Qed.

Lemma upper_unbounded share floor :
  upper unbounded share floor (rows_of unbounded d M v w) =
  (let terms := map product_term (map (outer (grown (INR d))) rows) in
   add (fst (summed terms)) (add (snd (summed terms)) (add (multiply share (sizes_of rows 0))
    (multiply floor (add 1 (moved_of rows 0))))), moved_of rows 0).
Proof.
  unfold upper.
  replace (fold_left (outer_loop unbounded) (rows_of unbounded d M v w) (nought, nought, nought, nought)) with
    (summed (map product_term (map (outer (grown (INR d))) rows)), sizes_of rows 0, moved_of rows 0)
    by (symmetry; exact (outer_sum (grown (INR d)) (rows_of unbounded d M v w) 0 0 0 0)).
  destruct (summed _) as [h l]. reflexivity.
Qed.

Lemma never_gains share floor : share = share_of (INR d) -> floor = INR d * 18014398509481984 * eta ->
  fst (upper unbounded share floor (rows_of unbounded d M v w)) <= 0 \/
  snd (upper unbounded share floor (rows_of unbounded d M v w)) = 0 ->
  quadratic d M w <= quadratic d M v.
Proof.
  intros -> ->. rewrite upper_unbounded. cbv zeta; cbn [fst snd]. intro H.
  assert (Hg : gamma rows <= 0); [| rewrite rows_gamma in Hg; lra].
  destruct H as [H | H].
  - exact (accepted_unbounded d largest d_positive d_small largest_positive rows rows_length rows_proper H).
  - pose proof (moved_kept d largest d_positive d_small rows rows_length rows_proper) as K. rewrite H in K.
    assert (C0 : 0 <= change rows) by (apply over_positive, Forall_forall; intros; apply Rabs_pos).
    assert (C : change rows = 0).
    { assert (0 < kept (INR d)) by (unfold kept; rewrite u_value; lra). apply Rle_antisym; [| exact C0].
      apply Rmult_le_reg_l with (1 := H0). lra. }
    right. pose proof rows_proper as P. revert C. clear - P.
    induction P as [| r l Hr P IH]; [reflexivity |]. change (change (r :: l)) with (Rabs (d_hi r) + change l). intro C.
    assert (0 <= change l) by (apply over_positive, Forall_forall; intros; apply Rabs_pos).
    pose proof (Rabs_pos (d_hi r)). destruct Hr as (_ & _ & _ & _ & Hd).
    cbn [gamma]. rewrite IH by lra. assert (Z : Rabs (d_hi r) = 0) by lra. rewrite Z, Rmult_0_r in Hd.
    assert (S : d_hi r + d_lo r = 0).
    { apply Rle_antisym; pose proof (Rle_abs (d_hi r)); pose proof (Rle_abs (d_lo r));
        pose proof (Rle_abs (- d_hi r)); pose proof (Rle_abs (- d_lo r)); rewrite !Rabs_Ropp in *; lra. }
    rewrite S. ring.
Qed.
End Matrix.

(* The acceptance in binary64: infinities and NaN included. *)
Theorem never_gains_in_binary64 d (M : nat -> nat -> double) (v w : nat -> double) (share floor : double) :
  (1 <= d)%nat -> INR d <= 32768 -> B2R share = share_of (INR d) -> B2R floor = INR d * 18014398509481984 * eta ->
  let bound := upper binary64 share floor (rows_of binary64 d M v w) in
  (is_finite (fst bound) = true /\ B2R (fst bound) <= 0) \/ (is_finite (snd bound) = true /\ B2R (snd bound) = 0) ->
  quadratic d (fun i j => B2R (M i j)) (fun i => B2R (w i)) <= quadratic d (fun i j => B2R (M i j))
    (fun i => B2R (v i)).
Proof.
  intros H1 H2 Hs Hf bound H.
  destruct (same_upper share (B2R share) floor (B2R floor) _ _ (fun _ => eq_refl) (fun _ => eq_refl)
    (same_rows d M v w)) as (U & K).
  fold bound in U, K.
  apply (never_gains d _ _ _ H1) with (share := B2R share) (floor := B2R floor); try assumption;
    try (intros; apply generic_format_B2R).
  - destruct H as [[F H] | [F H]]; [left; rewrite <- (U F) | right; rewrite <- (K F)]; exact H.
Qed.
Print Assumptions never_gains_in_binary64. (* if the bound that `gain` computes in binary64, overflow and underflow
   included, is finite and at most 0, then wᵀMw ≤ vᵀMv over the real numbers *)
